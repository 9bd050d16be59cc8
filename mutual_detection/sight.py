"""Whether a teammate stands where a transform between two maps says that it does, by one scan."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import Scan, se2

SEEN, UNSEEN, NOT_THERE = 1, 0, -1
"""A body stands there; the scan says nothing; the beams pass through."""
FARTHEST_M = 6.0
"""Teammates expected farther off are not looked for, metres: an error of 0.05 rad in a transform's angle, as bent maps
have, is then still within ``SEEN_WITHIN_M`` of the place."""
SEEN_WITHIN_M = 0.3
"""A body this near to where the teammate should be is the teammate, metres."""
NOT_WITHIN_M = 0.5
"""Beams must pass through all of the floor within this (and the body's radius) of the place to say that nobody is
there, metres: two standard deviations of the transform between maps that are bent as usual."""
BODY_NEAR_M = 1.0
"""... and no body is found within this, metres: it would be the teammate, and the transform a little off."""
BEAMS_LEAST = 5
"""Beams through that floor: fewer may all have missed a body."""


def look(scan: Scan, bodies_m: NDArray[np.float64], place_m: NDArray[np.float64], radius_m: float) -> int:
    """Return ``SEEN``, ``NOT_THERE`` or ``UNSEEN`` of a body expected at ``place_m`` ``(2,)``, base frame.

    ``bodies_m`` : ``(N, 2)``, what :func:`mrslam.mutual_detection.find_bodies` finds in the scan. Beams that end before
    the place say nothing, and neither do those that end near it on something else.
    """
    apart_m = np.hypot(*(bodies_m - place_m).T).min() if len(bodies_m) else np.inf
    at = se2.apply(se2.inverse(scan.T_base_laser), place_m)
    away_m, bearing = float(np.hypot(*at)), float(np.arctan2(at[1], at[0]))
    room_m = radius_m + NOT_WITHIN_M
    if away_m > FARTHEST_M:
        return UNSEEN
    if apart_m <= SEEN_WITHIN_M:
        return SEEN
    if apart_m <= BODY_NEAR_M or not room_m < away_m <= scan.range_max_m - room_m:
        return UNSEEN
    off = se2.wrap(scan.angles_rad - bearing)
    through = np.abs(off) <= np.arcsin(room_m / away_m)
    ranges = scan.ranges_m[through]
    if ranges.size < BEAMS_LEAST or _is_partly_outside(scan, bearing, room_m / away_m):
        return UNSEEN
    known = ranges[~np.isnan(ranges)]
    if known.size < 0.8 * ranges.size:
        return UNSEEN
    # How far the floor in question reaches along each beam.
    beyond = away_m * np.cos(off[through]) + np.sqrt(np.maximum(room_m**2 - (away_m * np.sin(off[through])) ** 2, 0.0))
    return NOT_THERE if (known > beyond[~np.isnan(ranges)]).all() else UNSEEN


def _is_partly_outside(scan: Scan, bearing: float, sine: float) -> bool:
    """Return whether an edge of the field of view cuts the floor in question."""
    half = float(np.arcsin(sine))
    span = abs(scan.angle_increment_rad) * scan.ranges_m.size
    if span >= 2.0 * np.pi - 1e-3:
        return False
    middle = scan.angle_min_rad + scan.angle_increment_rad * (scan.ranges_m.size - 1) / 2.0
    return bool(abs(float(se2.wrap(bearing - middle))) + half > span / 2.0)
