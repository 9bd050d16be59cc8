"""Rigid transforms from matched points with many wrong matches (Fischler and Bolles 1981)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

F64 = NDArray[np.float64]


@njit(cache=True, nogil=True)
def best_draw(
    p_a: F64, p_b: F64, draws: NDArray[np.int64], inlier_m: float
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return the row of ``draws`` (pairs of match indices) whose rigid transform has most inliers, and how many."""
    best, most = -1, 0
    limit = inlier_m * inlier_m
    for k in range(draws.shape[0]):
        i, j = draws[k, 0], draws[k, 1]
        ax, ay = p_a[j, 0] - p_a[i, 0], p_a[j, 1] - p_a[i, 1]
        bx, by = p_b[j, 0] - p_b[i, 0], p_b[j, 1] - p_b[i, 1]
        la, lb = math.sqrt(ax * ax + ay * ay), math.sqrt(bx * bx + by * by)
        # Short baselines give no direction; a change of length is a wrong match, for the scale is 1.
        if lb < 5.0 * inlier_m or abs(la - lb) > 2.0 * inlier_m:
            continue
        cos, sin = (ax * bx + ay * by) / (la * lb), (ay * bx - ax * by) / (la * lb)
        mx, my = 0.5 * (p_a[i, 0] + p_a[j, 0]), 0.5 * (p_a[i, 1] + p_a[j, 1])
        ux, uy = 0.5 * (p_b[i, 0] + p_b[j, 0]), 0.5 * (p_b[i, 1] + p_b[j, 1])
        tx, ty = mx - cos * ux + sin * uy, my - sin * ux - cos * uy
        inliers = 0
        for m in range(p_a.shape[0]):
            dx = tx + cos * p_b[m, 0] - sin * p_b[m, 1] - p_a[m, 0]
            dy = ty + sin * p_b[m, 0] + cos * p_b[m, 1] - p_a[m, 1]
            if dx * dx + dy * dy <= limit:
                inliers += 1
        if inliers > most:
            best, most = k, inliers
    return best, most


def rigid(
    p_a: F64, p_b: F64, draws: int, inlier_m: float, rng: np.random.Generator
) -> tuple[Transform, NDArray[np.bool_]] | None:
    """Return ``T_a_b`` of the largest set of agreeing matches and that set ``(N,) bool``, or None where there is none.

    Scale is 1. The transform is the least-squares fit of the inliers.
    """
    n = len(p_a)
    if n < 3:
        return None
    pairs = rng.integers(0, n, size=(draws, 2))
    k, _ = best_draw(p_a, p_b, pairs, inlier_m)
    if k < 0:
        return None
    inlier = np.zeros(n, dtype=np.bool_)
    inlier[pairs[k]] = True
    T_a_b = se2.fit_rigid(p_a[inlier], p_b[inlier])
    for _ in range(5):
        grown = np.hypot(*(se2.apply(T_a_b, p_b) - p_a).T) <= inlier_m
        if grown.sum() < 2 or (grown == inlier).all():
            break
        inlier = grown
        T_a_b = se2.fit_rigid(p_a[inlier], p_b[inlier])
    return T_a_b, inlier
