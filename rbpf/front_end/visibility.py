"""What one scan says of another that was taken near it: the same surfaces bound what both can see."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

BINS = 360
"""Bearings are told apart to a degree: finer than doors are wide, coarser than most lasers' beams."""
REACH_MOST = 15
"""Most bins to either side within which beams bound what lies between them: a laser of a dozen beams in half a turn."""
NEAR_M, NEAR_SHARE = 0.1, 0.03
"""Ranges agree within the first, metres, and the second, a share of the range: noise, and a degree on a slanting wall.
Of 22 000 pairs of scans in succession on intel, aces and mit-csail 0.1 % contradict each other by more than 0.14."""


@njit(cache=True, nogil=True)
def contradicted(
    points: NDArray[np.float64],
    seen: NDArray[np.float64],
    T_seen_points: NDArray[np.float64],
    origin: NDArray[np.float64],
) -> float:  # pragma: no cover - compiled
    """Return the share, 0..1, of a scan's ``points (N, 5)`` that lie before or behind what another one saw there.

    ``seen (M, 5)`` : the other one's points. ``T_seen_points (3,)`` : maps the first's frame to the other's.
    ``origin (2,)`` : of the laser in either frame. Bearings in which the other one saw nothing do not count; 0 where
    none is left.
    """
    nearest, farthest = np.full(BINS, np.inf), np.zeros(BINS)
    for i in range(seen.shape[0]):
        dx, dy = seen[i, 0] - origin[0], seen[i, 1] - origin[1]
        k = _bin(dx, dy)
        range_m = math.hypot(dx, dy)
        nearest[k], farthest[k] = min(nearest[k], range_m), max(farthest[k], range_m)
    reach = _reach(farthest)
    c, s = math.cos(T_seen_points[2]), math.sin(T_seen_points[2])
    count = wrong = 0
    for i in range(points.shape[0]):
        dx = T_seen_points[0] + c * points[i, 0] - s * points[i, 1] - origin[0]
        dy = T_seen_points[1] + s * points[i, 0] + c * points[i, 1] - origin[1]
        k = _bin(dx, dy)
        least, most = np.inf, 0.0
        for step in range(-reach, reach + 1):
            b = (k + step) % BINS
            least, most = min(least, nearest[b]), max(most, farthest[b])
        if most > 0.0:
            range_m = math.hypot(dx, dy)
            near_m = NEAR_M + NEAR_SHARE * range_m
            count += 1
            wrong += range_m < least - near_m or range_m > most + near_m
    return wrong / count if count > 0 else 0.0


@njit(cache=True, nogil=True)
def _reach(farthest: NDArray[np.float64]) -> int:  # pragma: no cover - compiled
    """Return how many bins a laser's beams are apart: the median of the steps from one bin with a beam to the next."""
    bins = np.flatnonzero(farthest > 0.0)
    if bins.size < 2:
        return 1
    return min(max(int(np.median(np.diff(bins))), 1), REACH_MOST)


@njit(cache=True, nogil=True)
def _bin(dx: float, dy: float) -> int:  # pragma: no cover - compiled
    """Return the number of a bearing's bin."""
    return int((math.atan2(dy, dx) + math.pi) / (2.0 * math.pi) * BINS) % BINS
