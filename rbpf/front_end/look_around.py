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
    FAR_M,
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
from mrslam.spatial.runtime.crew import Crew
from mrslam.spatial.se2 import Transform

SQUARE_M, SQUARES = 1.0, (-2.0, 0.0, 2.0)
"""Half width of a square that shows its best place, metres, and middles of squares along either axis, metres from where
odometry leads: what is farther off than all of them is for those who look for a robot that was carried."""
LEAP_M = 2.0
"""A place farther than this from where odometry leads is not believed by one scan: similar rooms are as near."""
TURN_MOST_RAD = 0.7
"""Half width of the search in heading."""
RIVAL = 0.9
"""Another place that this share of the beams that fit the best one fit may as well be where the robot is."""
SHOWN_LEAST = 0.4
"""Least share of a scan's beams that must end where the map shows anything."""
LED_TO = (-0.2, 0.0, 0.2)
"""Where descents begin along either axis, metres from where odometry leads."""
CLEARLY = 0.15
"""Of the beams on known floor so many fewer end at walls than fit well, or fit usually where that is less, as before
trees, where the map contradicts: a share of 0..1."""
SLIGHTLY = 0.05
"""Where the map does not show where wheels lead, a place far off must be fitted by as many beams as usual, but for this
share of 0..1: a room like another has something else in it."""


class Looked(NamedTuple):
    """What a robot's map says of the place where odometry leads."""

    place: Transform | None
    """``(3,)``, where the scan surely fits, there or near by; None where the map shows no such place."""
    is_contradicted: bool
    """Whether the map shows what is to be seen there, it is something else, and nothing near by fits."""
    is_unknown: bool = False
    """Whether the map shows too little of what is to be seen there to say either."""


def look_around(
    tiles: Tiles,
    points: NDArray[np.float64],
    T_map_base: Transform,
    sigma_m: float,
    crew: Crew | None,
    usual_fit: float = 1.0,
) -> Looked:
    """Return whether a scan fits its robot's map at ``T_map_base (3,)``, where odometry leads, or near by.

    A place farther off than ``LEAP_M`` is taken only where as much of the scan fits it as usual, or where the map shows
    that the robot is not where odometry leads.
    ``points (N, 5)`` : those of the scan to match; ``sigma_m`` : their deviation from walls, metres. Threads of the
    ``crew`` that have nothing to do help. ``usual_fit`` : share of the beams on known floor that fitted of late, 0..1.
    """
    found = match(tiles, points, T_map_base, T_map_base, FAR_PRIOR, sigma_m, ITERATIONS)
    least = min(GOOD_INLIERS, usual_fit) - CLEARLY
    if _fit(found) >= least:
        return Looked(found.pose if _is_sure(found) else None, False, _is_unknown(found))
    best, is_only = _best_place(tiles, points, T_map_base, sigma_m, crew)
    led_to = _led_to(tiles, points, T_map_base, sigma_m)
    is_unknown = _is_unknown(led_to)
    # Nothing says that odometry is wrong, and what is seen may be as new there as where odometry leads.
    fits_little = best.inliers < max(GOOD_INLIERS, usual_fit - SLIGHTLY)
    is_leap = is_unknown and fits_little and is_beyond(T_map_base, best.pose)
    if is_only and _is_sure(best) and not is_leap:
        return Looked(best.pose, False)
    is_near = _are_within(T_map_base, best.pose, FAR_M, FAR_TURN_RAD)  # wheels may well have come there
    if is_near and not _is_unknown(best) and _fit(best) >= least:
        return Looked(None, False)
    return Looked(None, not is_unknown, is_unknown)


def found_near(
    tiles: Tiles, points: NDArray[np.float64], T_map_base: Transform, sigma_m: float, crew: Crew | None = None
) -> Transform | None:
    """Return the place ``(3,)`` of a robot in a map that is not its own, None where that is not sure.

    It is where odometry leads if most of the scan fits there, else the only place near by where the scan surely fits.
    What a map's own robot does not know it has not seen; in a map that was saved, beams that end in what is unknown may
    as well have gone through walls. Arguments as for :func:`look_around`.
    """
    found = match(tiles, points, T_map_base, T_map_base, FAR_PRIOR, sigma_m, ITERATIONS)
    if found.inliers >= GOOD_INLIERS:
        return found.pose
    best, is_only = _best_place(tiles, points, T_map_base, sigma_m, crew)
    return best.pose if is_only and _is_sure(best) else None


def shown_at(tiles: Tiles, points: NDArray[np.float64], T_map_base: Transform, sigma_m: float) -> Transform | None:
    """Return the pose next to ``T_map_base (3,)`` where a scan surely fits, not just along a corridor, or None.

    Arguments as for :func:`look_around`.
    """
    found = match(tiles, points, T_map_base, T_map_base, FAR_PRIOR, sigma_m, ITERATIONS)
    return found.pose if _is_sure(found) and found.blind == 0.0 else None


def is_elsewhere(expected: Transform, place: Transform) -> bool:
    """Return whether a place ``(3,)`` is not the one expected."""
    return not _are_within(expected, place, NEAR_M, NEAR_TURN_RAD)


def is_beyond(expected: Transform, place: Transform) -> bool:
    """Return whether a place ``(3,)`` is farther from the one expected than ``LEAP_M``."""
    return not _are_within(expected, place, LEAP_M, math.pi)


def _are_within(one: Transform, other: Transform, away_m: float, turn_rad: float) -> bool:
    """Return whether two poses ``(3,)`` are no farther from each other than this, metres and radians."""
    x_m, y_m, turned_rad = between(one, other)
    return math.hypot(x_m, y_m) <= away_m and abs(turned_rad) <= turn_rad


def _best_place(
    tiles: Tiles, points: NDArray[np.float64], T_map_base: Transform, sigma_m: float, crew: Crew | None
) -> tuple[Match, bool]:
    """Return where near a pose a scan fits best, and whether it fits nowhere else nearly as well.

    Arguments as for :func:`look_around`.
    """
    lattice = Lattice(TURN_MOST_RAD, FAR_STEP_RAD, SQUARE_M, STEP_M, POINTS_SEARCHED)
    middles = (T_map_base + np.array([x_m, y_m, 0.0]) for x_m in SQUARES for y_m in SQUARES)
    starts = (search(tiles, points, middle, lattice, crew).pose for middle in middles)
    places = [match(tiles, points, start, start, FAR_PRIOR, sigma_m, ITERATIONS) for start in starts]
    best = max(places, key=lambda place: place.inliers)
    rivals = (place for place in places if is_elsewhere(best.pose, place.pose))
    return best, all(rival.inliers < RIVAL * best.inliers for rival in rivals)


def _led_to(tiles: Tiles, points: NDArray[np.float64], T_map_base: Transform, sigma_m: float) -> Match:
    """Return where a scan fits best within reach of where wheels lead: one descent may end behind the right wall."""
    starts = (T_map_base + np.array([x_m, y_m, 0.0]) for x_m in LED_TO for y_m in LED_TO)
    return max(
        (match(tiles, points, start, start, FAR_PRIOR, sigma_m, ITERATIONS) for start in starts),
        key=lambda place: place.score,
    )


def _is_sure(found: Match) -> bool:
    """Return whether a scan fits a place of which the map shows enough."""
    return _shown(found) >= SHOWN_LEAST and _fit(found) >= GOOD_INLIERS


def _is_unknown(found: Match) -> bool:
    """Return whether the map shows too little of what is to be seen from a place."""
    return _shown(found) < SHOWN_LEAST


def _shown(found: Match) -> float:
    """Return which share of the beams end where the map shows anything, 0..1."""
    return found.inliers + found.conflicts


def _fit(found: Match) -> float:
    """Return which share of the beams on known floor end at walls, 0..1; 1 where the map shows nothing."""
    shown = _shown(found)
    return found.inliers / shown if shown > 0.0 else 1.0
