"""Where a robot is that saw nothing for a while: odometry may have jumped meanwhile, or been set back to zero.

Its own map shows what is free, so it can confirm the place that odometry leads to, or contradict it and show another
near by.
"""

from __future__ import annotations

import math
from typing import NamedTuple

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


class Looked(NamedTuple):
    """What a robot's map says of the place where odometry leads."""

    place: Transform | None
    """``(3,)``, where the scan surely fits, there or near by; None where the map shows no such place."""
    is_contradicted: bool
    """Whether the map shows what is to be seen there, it is something else, and nothing near by fits."""


def look_around(tiles: Tiles, points: NDArray[np.float64], T_map_base: Transform, sigma_m: float) -> Looked:
    """Return whether a scan fits its robot's map at ``T_map_base (3,)``, where odometry leads, or near by.

    ``points (N, 5)`` : those of the scan to match; ``sigma_m`` : their deviation from walls, metres.
    """
    found = match(tiles, points, T_map_base, T_map_base, FAR_PRIOR, sigma_m, ITERATIONS)
    is_refuted = _fit(found) < GOOD_INLIERS - CLEARLY
    is_shown = _shown(found) >= SHOWN_LEAST
    if is_refuted:
        lattice = Lattice(FAR_TURN_RAD, FAR_STEP_RAD, REACH_M, STEP_M, POINTS_SEARCHED)
        place = search(tiles, points, T_map_base, lattice).pose
        found = match(tiles, points, place, place, FAR_PRIOR, sigma_m, ITERATIONS)
    is_sure = _shown(found) >= SHOWN_LEAST and _fit(found) >= GOOD_INLIERS
    return Looked(found.pose if is_sure else None, is_shown and is_refuted and not is_sure)


def is_elsewhere(expected: Transform, place: Transform) -> bool:
    """Return whether a place ``(3,)`` is not the one expected."""
    x_m, y_m, turn_rad = between(expected, place)
    return math.hypot(x_m, y_m) > NEAR_M or abs(turn_rad) > NEAR_TURN_RAD


def _shown(found: Match) -> float:
    """Return which share of the beams end where the map shows anything, 0..1."""
    return found.inliers + found.conflicts


def _fit(found: Match) -> float:
    """Return which share of the beams on known floor end at walls, 0..1; 1 where the map shows nothing."""
    shown = _shown(found)
    return found.inliers / shown if shown > 0.0 else 1.0
