"""The blocks of a pose graph's normal equations over SE(2), added up edge by edge."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def add_up(
    poses: NDArray[np.float64],
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    place: NDArray[np.int64],
    block: NDArray[np.int64],
    error: NDArray[np.float64],
    information: NDArray[np.float64],
    weight: NDArray[np.float64],
    diagonal: NDArray[np.float64],
    below: NDArray[np.float64],
    pull: NDArray[np.float64],
) -> None:  # pragma: no cover - compiled
    """Add every edge's part to ``diagonal (N, 3, 3)``, to ``below (M, 3, 3)`` and to the right side ``pull (N, 3)``.

    ``place (K,)`` : a pose's row among the equations, -1 where it is held. ``block (E,)`` : an edge's among ``below``,
    -1 where it has none; of its two poses the one that is placed later is the block's row.
    ``error (E, 3)``, ``information (E, 3, 3)``, ``weight (E,)`` : the edges' residuals in the axes of their first pose.
    """
    a, b, wa, wb = np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3)), np.zeros((3, 3))
    a[2, 2], b[2, 2] = -1.0, 1.0
    for e in range(first.size):
        i, j = first[e], second[e]
        cos, sin = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        dx, dy = poses[j, 0] - poses[i, 0], poses[j, 1] - poses[i, 1]
        b[0, 0], b[0, 1], b[1, 0], b[1, 1] = cos, sin, -sin, cos
        a[0, 0], a[0, 1], a[1, 0], a[1, 1] = -cos, -sin, sin, -cos
        a[0, 2], a[1, 2] = cos * dy - sin * dx, -cos * dx - sin * dy
        row, column = place[i], place[j]
        for k in range(3):
            for m in range(3):
                wa[k, m] = wb[k, m] = 0.0
                for n in range(3):
                    wa[k, m] += weight[e] * information[e, k, n] * a[n, m]
                    wb[k, m] += weight[e] * information[e, k, n] * b[n, m]
        if row >= 0:
            _add(a, wa, diagonal[row])
            _pull(wa, error[e], pull[row])
        if column >= 0:
            _add(b, wb, diagonal[column])
            _pull(wb, error[e], pull[column])
        if block[e] >= 0 and row > column:
            _add(a, wb, below[block[e]])
        elif block[e] >= 0:
            _add(b, wa, below[block[e]])


@njit(cache=True, nogil=True)
def _add(
    one: NDArray[np.float64], other: NDArray[np.float64], to: NDArray[np.float64]
) -> None:  # pragma: no cover - compiled
    """Add the product of the transpose of ``one (3, 3)`` and ``other (3, 3)``."""
    for k in range(3):
        for m in range(3):
            to[k, m] += one[0, k] * other[0, m] + one[1, k] * other[1, m] + one[2, k] * other[2, m]


@njit(cache=True, nogil=True)
def _pull(
    weighted: NDArray[np.float64], error: NDArray[np.float64], to: NDArray[np.float64]
) -> None:  # pragma: no cover - compiled
    """Add the gradient that an edge's ``error (3,)`` has by a pose, downhill."""
    for k in range(3):
        to[k] -= weighted[0, k] * error[0] + weighted[1, k] * error[1] + weighted[2, k] * error[2]
