"""Which keyframe of one robot is nearest to each of another's."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

BLOCK = 16
"""Keyframes of a robot, one after the other, that are looked at together: some 10 m of its way."""


@njit(cache=True, nogil=True)
def nearest_keys(
    T_a: NDArray[np.float64], T_b: NDArray[np.float64], turn_cost_m: float, most_m: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:  # pragma: no cover - compiled
    """Return by row of ``T_b (N, 3)`` the nearest row of ``T_a (K, 3)``, and how far away it is, metres.

    One radian of turn counts as ``turn_cost_m`` metres, but is not part of the distance returned. Where the nearest is
    farther than ``most_m`` away it may be any, infinitely far.
    """
    low, high = _boxes(T_a)
    nearest, away_m = np.zeros(len(T_b), dtype=np.int64), np.full(len(T_b), math.inf)
    for j in range(len(T_b)):
        least = most_m + turn_cost_m * math.pi
        for block in range(len(low)):
            aside = max(low[block, 0] - T_b[j, 0], T_b[j, 0] - high[block, 0], 0.0)
            ahead = max(low[block, 1] - T_b[j, 1], T_b[j, 1] - high[block, 1], 0.0)
            if aside * aside + ahead * ahead >= least * least:
                continue
            for i in range(block * BLOCK, min((block + 1) * BLOCK, len(T_a))):
                dx, dy = T_a[i, 0] - T_b[j, 0], T_a[i, 1] - T_b[j, 1]
                if dx * dx + dy * dy >= least * least:
                    continue
                away = math.sqrt(dx * dx + dy * dy)
                turn = abs(T_a[i, 2] - T_b[j, 2]) % (2.0 * math.pi)
                cost = away + turn_cost_m * min(turn, 2.0 * math.pi - turn)
                if cost < least:
                    least, nearest[j], away_m[j] = cost, i, away
    return nearest, away_m


@njit(cache=True, nogil=True)
def _boxes(
    T_a: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:  # pragma: no cover - compiled
    """Return the corners ``(B, 2)`` of the boxes around every ``BLOCK`` keyframes ``(K, 3)``."""
    count = (len(T_a) + BLOCK - 1) // BLOCK
    low, high = np.full((count, 2), math.inf), np.full((count, 2), -math.inf)
    for i in range(len(T_a)):
        for axis in range(2):
            low[i // BLOCK, axis] = min(low[i // BLOCK, axis], T_a[i, axis])
            high[i // BLOCK, axis] = max(high[i // BLOCK, axis], T_a[i, axis])
    return low, high
