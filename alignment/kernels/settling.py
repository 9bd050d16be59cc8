"""Compiled loop that settles many places on the walls and looks what speaks for each: one call, not one a place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.kernels.agreement import agreement, free_overlap
from mrslam.alignment.kernels.fit import gauss_newton
from mrslam.alignment.kernels.walls import WallMap

F64 = NDArray[np.float64]


@njit(cache=True, nogil=True)
def settle_places(
    a: WallMap,
    b: WallMap,
    T_a_b: F64,
    centres: F64,
    steps: tuple[int, int, int],
    schedule: F64,
    tolerance_m: float,
) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Lay walls on walls from each of the places ``T_a_b (N, 3)``, which are overwritten; return the counts ``(N, 7)``.

    Counts: matched, opposed, contradicted points of b laid on a, of a laid on b, cells free in both. ``centres (2, 2)``
    : middle of a's walls and of b's; ``steps`` : of points of a, of b, and of the smaller map's rows and columns every
    so many; ``schedule (K, 3)`` : reach and kernel scale, metres, and rounds, from coarse to fine.
    """
    counts = np.zeros((T_a_b.shape[0], 7), dtype=np.int64)
    verdict = np.empty(max(a.points.shape[0], b.points.shape[0]), dtype=np.uint8)
    pivot, T_b_a = np.empty(2), np.empty(3)
    small_is_a = a.state.size <= b.state.size
    for n in range(T_a_b.shape[0]):
        T = T_a_b[n]
        cos, sin = math.cos(T[2]), math.sin(T[2])
        pivot[0] = 0.5 * (centres[0, 0] + T[0] + cos * centres[1, 0] - sin * centres[1, 1])
        pivot[1] = 0.5 * (centres[0, 1] + T[1] + sin * centres[1, 0] + cos * centres[1, 1])
        for k in range(schedule.shape[0]):
            rounds = int(schedule[k, 2])
            if not gauss_newton(a, b, T, pivot, (steps[0], steps[1]), schedule[k, 0], schedule[k, 1], rounds):
                break
        cos, sin = math.cos(T[2]), math.sin(T[2])
        T_b_a[0], T_b_a[1], T_b_a[2] = -cos * T[0] - sin * T[1], sin * T[0] - cos * T[1], -T[2]
        matched, opposed, against, _ = agreement(b, a, T, steps[1], tolerance_m, verdict)
        counts[n, 0], counts[n, 1], counts[n, 2] = matched, opposed, against
        matched, opposed, against, _ = agreement(a, b, T_b_a, steps[0], tolerance_m, verdict)
        counts[n, 3], counts[n, 4], counts[n, 5] = matched, opposed, against
        if small_is_a:
            free, _, _, _ = free_overlap(a.state, a.x0, a.y0, steps[2], T_b_a, b.state, b.x0, b.y0, a.res)
        else:
            free, _, _, _ = free_overlap(b.state, b.x0, b.y0, steps[2], T, a.state, a.x0, a.y0, a.res)
        counts[n, 6] = free
    return counts
