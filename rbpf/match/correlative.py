"""Correlative search: the best of a lattice of poses, where the prediction is too poor to descend from."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.rbpf.crew import Crew
from mrslam.rbpf.match.nearest import nearest

SCORE, RANK = 3, 4
"""Columns of what :func:`search_turns` writes after the pose."""
POINTS = slice(5, 7)
"""Where among its arguments the points are, and how many of them it uses at most."""


@njit(cache=True, nogil=True)
def search_turns(
    pool: NDArray[np.uint32],
    table: NDArray[np.int32],
    row0: int,
    col0: int,
    resolution_m: float,
    points: NDArray[np.float64],
    most_points: int,
    centre: NDArray[np.float64],
    half_turn: float,
    turn_step: float,
    half_shift_m: float,
    shift_step_m: float,
    cos_table: NDArray[np.float64],
    sin_table: NDArray[np.float64],
    first: int,
    step: int,
    out: NDArray[np.float64],
) -> None:  # pragma: no cover - compiled
    """Write the best pose of every ``step``-th turn of a lattice into ``out (5,)``, its score and its rank.

    Of the whole lattice the best is the one with the highest score, and of those the one with the lowest rank.
    """
    inv = 1.0 / resolution_m
    stride = max(1, points.shape[0] // most_points)
    turns = int(half_turn / turn_step)
    shifts = int(half_shift_m / shift_step_m + 0.5)
    used = (points.shape[0] + stride - 1) // stride
    best = -1.0
    out[0], out[1], out[2], out[3], out[4] = centre[0], centre[1], centre[2], best, 1e9
    if used == 0:
        return
    turned = np.empty((used, 5))
    # From the middle outward: a good score early spares most of the others.
    for ka in range(first, 2 * turns + 1, step):
        a = (ka + 1) // 2 if ka % 2 else -(ka // 2)
        theta = centre[2] + a * turn_step
        c, s = math.cos(theta), math.sin(theta)
        for k in range(used):
            i = k * stride
            turned[k, 0] = (centre[0] + c * points[i, 0] - s * points[i, 1]) * inv
            turned[k, 1] = (centre[1] + s * points[i, 0] + c * points[i, 1]) * inv
            turned[k, 2] = c * points[i, 2] - s * points[i, 3]
            turned[k, 3] = s * points[i, 2] + c * points[i, 3]
            turned[k, 4] = points[i, 4]
        for ky in range(2 * shifts + 1):
            iy = (ky + 1) // 2 if ky % 2 else -(ky // 2)
            y = iy * shift_step_m
            for kx in range(2 * shifts + 1):
                ix = (kx + 1) // 2 if kx % 2 else -(kx // 2)
                x = ix * shift_step_m
                # Of two equal poses the one nearer to the prediction.
                far = 1e-3 * used * (abs(a) / (turns + 1.0) + (abs(ix) + abs(iy)) / (shifts + 1.0))
                score = -far
                for k in range(used):
                    word, _, _, d2 = nearest(
                        pool, table, row0, col0, turned[k, 0] + x * inv, turned[k, 1] + y * inv, turned[k, 2],
                        turned[k, 3], turned[k, 4], 1, cos_table, sin_table,
                    )  # fmt: skip
                    if word != 0:
                        score += 1.0 / (1.0 + d2)
                    if score + (used - 1 - k) <= best:
                        break
                if score > best:
                    best = score
                    out[0], out[1], out[2] = centre[0] + x, centre[1] + y, theta
                    out[3], out[4] = best, (ka * (2 * shifts + 1) + ky) * (2 * shifts + 1) + kx


def search(*lattice: Any, out: NDArray[np.float64], crew: Crew | None = None) -> float:
    """Write the best pose of a lattice around a centre into ``out (3,)`` and return its score per point, 0..1.

    Correlative matching (Olson 2009) on a subset of the points; gives :func:`match` a start where prediction is poor.
    ``lattice`` : what :func:`search_turns` takes, up to the tables of directions. Where another thread of the ``crew``
    has nothing to do it takes half of the turns; the result is the same.
    """
    found = np.empty((2, RANK + 1))
    turns: Callable[..., None] = partial(search_turns, *lattice)
    if crew is None or not crew.is_idle:
        turns(0, 1, found[0])
        best = found[0]
    else:
        crew.both(partial(turns, 0, 2, found[0]), partial(turns, 1, 2, found[1]))
        best = min(found, key=lambda half: (-half[SCORE], half[RANK]))
    out[:] = best[:SCORE]
    points, most_points = lattice[POINTS]
    used = -(-points.shape[0] // max(1, points.shape[0] // most_points))
    return float(best[SCORE]) / used if used else 0.0
