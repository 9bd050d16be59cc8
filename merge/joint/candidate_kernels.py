"""Which keyframe of one robot is nearest to each of another's."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def nearest_keys(
    T_a: NDArray[np.float64], T_b: NDArray[np.float64], turn_cost_m: float
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:  # pragma: no cover - compiled
    """Return by row of ``T_b (N, 3)`` the nearest row of ``T_a (K, 3)``, K >= 1, and how far away it is, metres.

    One radian of turn counts as ``turn_cost_m`` metres, but is not part of the distance returned.
    """
    nearest, away_m = np.zeros(len(T_b), dtype=np.int64), np.zeros(len(T_b))
    for j in range(len(T_b)):
        least = math.inf
        for i in range(len(T_a)):
            dx, dy = T_a[i, 0] - T_b[j, 0], T_a[i, 1] - T_b[j, 1]
            if dx * dx + dy * dy >= least * least:
                continue
            away = math.sqrt(dx * dx + dy * dy)
            turn = abs(T_a[i, 2] - T_b[j, 2]) % (2.0 * math.pi)
            cost = away + turn_cost_m * min(turn, 2.0 * math.pi - turn)
            if cost < least:
                least, nearest[j], away_m[j] = cost, i, away
    return nearest, away_m
