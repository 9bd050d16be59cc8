"""Where a robot is that saw nothing for a while: odometry may have jumped meanwhile, or been set back to zero.

Its own map shows what is free, so it can confirm the place that odometry leads to, or contradict it and show another
near by.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.front_end.local_matcher import (
    FAR_PRIOR,
    FAR_STEP_RAD,
    FAR_TURN_RAD,
    GOOD_INLIERS,
    ITERATIONS,
    NEAR_M,
    NEAR_TURN_RAD,
    POINTS_SEARCHED,
    STEP_M,
)
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.matching.gauss_newton import Match, match
from mrslam.spatial.poses import between
from mrslam.spatial.se2 import Transform

REACH_M = 1.5
"""Half width of the search, metres: farther off is for those who look for a robot that was carried."""
SHOWN_LEAST = 0.4
"""Least share of a scan's beams that must end where the map shows anything."""
CLEARLY = 0.15
"""Of the beams on known floor so many fewer end at walls than fit well where the map contradicts, a share of 0..1."""


def look_around(tiles: Tiles, points: NDArray[np.float64], T_map_base: Transform, sigma_m: float) -> Transform | None:
    """Return where a scan surely fits its robot's map, ``(3,)`` : at ``T_map_base``, where odometry leads, or near by.

    ``points (N, 5)`` : those of the scan to match; ``sigma_m`` : their deviation from walls, metres. None where the map
    shows too little.
    """
    found = match(tiles, points, T_map_base, T_map_base, FAR_PRIOR, sigma_m, ITERATIONS)
    if _fit(found) < GOOD_INLIERS - CLEARLY:
        lattice = Lattice(FAR_TURN_RAD, FAR_STEP_RAD, REACH_M, STEP_M, POINTS_SEARCHED)
        place = search(tiles, points, T_map_base, lattice).pose
        found = match(tiles, points, place, place, FAR_PRIOR, sigma_m, ITERATIONS)
    is_sure = found.inliers + found.conflicts >= SHOWN_LEAST and _fit(found) >= GOOD_INLIERS
    return found.pose if is_sure else None


def is_elsewhere(expected: Transform, place: Transform) -> bool:
    """Return whether a place ``(3,)`` is not the one expected."""
    x_m, y_m, turn_rad = between(expected, place)
    return math.hypot(x_m, y_m) > NEAR_M or abs(turn_rad) > NEAR_TURN_RAD


def _fit(found: Match) -> float:
    """Return which share of the beams on known floor end at walls, 0..1; 1 where the map shows nothing."""
    shown = found.inliers + found.conflicts
    return found.inliers / shown if shown > 0.0 else 1.0
