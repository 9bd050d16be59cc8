"""How likely a place of a map has a look-alike in the part of the building that the map does not show."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from mrslam.alignment.aligners import ALIGNERS
from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels import walls as wall_kernels
from mrslam.alignment.prepared import PreparedMap, main_part, prepare, working_resolution
from mrslam.alignment.verification.fits import fits_of
from mrslam.alignment.verification.reasons import tests
from mrslam.alignment.verification.verify import examine
from mrslam.spatial import OccupancyGrid, se2

METHOD = "auto"
"""The method that proposes every distinct place."""
ROOM_M2 = 15.0
"""Floor of a room, square metres: what is compared when one place of a building is said to look like another."""
GAP_M = 0.5
"""Edges of the known floor that reach no farther are gaps between beams and shadows of legs, metres: no robot drives
through them."""
MOVED_M, TURNED_RAD = 0.5, math.radians(6.0)
"""A map laid on itself nearer than this is where it was."""


def look_alikes(grid: OccupancyGrid, enough: float) -> float:
    """Return how many look-alikes of one of a map's places are to be expected beyond the map; at most ``enough`` or so.

    The open share of the outline, free floor that ends at nothing known for each metre of wall, says how much of the
    building the map does not show for what it shows. The share of the walls that fit elsewhere in the map as well says
    how often a place looks like another; where none does, it is less than one in the rooms that it shows.
    """
    known = _main_part_of(grid)
    unseen = _open_share(known)
    if math.isinf(unseen):
        return math.inf
    seldom = min(ROOM_M2 / known.known_m2, 1.0)
    if unseen < enough or unseen * seldom >= enough:
        return unseen * seldom
    return unseen * max(seldom, repeated_m(known) / known.wall_m)


def open_share(grid: OccupancyGrid) -> float:
    """Return how much of a map's outline is open, for each metre of its walls; inf where it has none."""
    return _open_share(_main_part_of(grid))


def _main_part_of(grid: OccupancyGrid) -> PreparedMap:
    part = main_part(grid.cropped())
    return prepare(part, working_resolution(part, part, AlignmentConfig()))


def _open_share(known: PreparedMap) -> float:
    return open_m(known) / known.wall_m if known.wall_m > 0.0 else math.inf


def open_m(known: PreparedMap) -> float:
    """Return the length of the edges where free floor ends at what is unknown, metres; those of ``GAP_M`` are left out.

    Each edge counts by the longer side of its box.
    """
    import cv2

    unknown = np.asarray(known.state == wall_kernels.UNKNOWN, dtype=np.uint8)
    beside = np.asarray(cv2.dilate(unknown, np.ones((3, 3), dtype=np.uint8)), dtype=np.bool_)
    edge = (known.state == wall_kernels.FREE) & beside
    _, _, boxes, _ = cv2.connectedComponentsWithStats(np.asarray(edge, dtype=np.uint8), connectivity=8)
    reach_m = known.res * boxes[1:, [cv2.CC_STAT_WIDTH, cv2.CC_STAT_HEIGHT]].max(axis=1, initial=0)
    return float(reach_m[reach_m > GAP_M].sum())


def repeated_m(known: PreparedMap) -> float:
    """Return the most wall of a map that would be taken for another part of it, metres; 0 where none would."""
    config = AlignmentConfig(strain=0.0)
    most = 0.0
    for case, T, _ in fits_of(known, known, ALIGNERS[METHOD](known, known, config, None), config):
        if math.hypot(*(se2.apply(T, known.centre) - known.centre)) < MOVED_M and abs(se2.wrap(T[2])) < TURNED_RAD:
            continue
        found = replace(examine(known, known, T, config.tolerance_m).evidence, score_m=case.worth(), margin=1.0)
        if all(test.slack >= 0 for test in tests(found, config)):
            most = max(most, found.matched_m)
    return most
