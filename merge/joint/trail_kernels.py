"""Where a robot came back to a place that it had left long before."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def seen_again(
    T_map_key: NDArray[np.float64], way_m: NDArray[np.float64], old_way_m: float, near_m: float, every_m: float
) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return ``(E, 2)``: keyframes, the earlier first, within ``near_m`` of each other and ``old_way_m`` of path apart.

    ``T_map_key (K, 3)``, ``way_m (K,)`` : path to each, metres. Of the earlier ones the nearest is taken; the later
    ones are at least ``every_m`` of path apart.
    """
    found = np.empty((len(T_map_key), 2), dtype=np.int64)
    count, old, last_m = 0, 0, -math.inf
    for j in range(len(T_map_key)):
        while way_m[old] < way_m[j] - old_way_m:
            old += 1
        if way_m[j] - last_m < every_m:
            continue
        nearest, least2 = -1, near_m * near_m
        for i in range(old):
            dx, dy = T_map_key[i, 0] - T_map_key[j, 0], T_map_key[i, 1] - T_map_key[j, 1]
            if dx * dx + dy * dy < least2:
                nearest, least2 = i, dx * dx + dy * dy
        if nearest >= 0:
            found[count, 0], found[count, 1] = nearest, j
            count, last_m = count + 1, way_m[j]
    return found[:count]
