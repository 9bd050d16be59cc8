"""What one scan says of a teammate expected at a place."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.mutual_detection import find_bodies
from mrslam.mutual_detection.sight import NOT_THERE, SEEN, UNSEEN, look
from mrslam.spatial import Scan
from tests.mutual_detection.sights import RADIUS_M

AHEAD = np.array([3.0, 0.0])


def scan_of(body_m: float | None = None, wall_m: float = 6.0, wide: bool = True, **changed: float) -> Scan:
    """Return a scan of a round wall around the robot, with a body so far ahead of it."""
    half = np.pi if wide else 0.2
    angles = np.linspace(-half, half, 721 if wide else 41)[: -1 if wide else None]
    ranges = np.full(angles.size, wall_m)
    if body_m is not None:
        inside = np.abs(body_m * np.sin(angles)) < RADIUS_M
        hit = inside & (np.cos(angles) > 0)
        ranges[hit] = body_m * np.cos(angles[hit]) - np.sqrt(RADIUS_M**2 - (body_m * np.sin(angles[hit])) ** 2)
    for name, value in changed.items():
        chosen = {"ahead": np.abs(angles) < 0.3, "one": np.abs(angles - 0.1) < 0.005}[name]
        ranges[chosen] = value
    return Scan(
        stamp_ns=0, ranges_m=ranges.astype(np.float32), angle_min_rad=angles[0],
        angle_increment_rad=angles[1] - angles[0], range_max_m=12.0,
    )  # fmt: skip


def verdict(scan: Scan, place: np.ndarray = AHEAD) -> int:
    return look(scan, find_bodies(scan, RADIUS_M), place, RADIUS_M)


def test_a_body_there_is_seen_and_free_sight_through_the_place_says_that_nobody_is_there() -> None:
    assert verdict(scan_of(3.0)) == verdict(scan_of(3.2)) == SEEN
    assert verdict(scan_of()) == NOT_THERE
    assert verdict(scan_of(ahead=np.inf)) == NOT_THERE  # nothing up to 12 m


@pytest.mark.parametrize(
    "scan",
    [
        scan_of(3.7),  # a transform may be a little off
        scan_of(2.2),
        scan_of(3.95),
        scan_of(1.2),  # another body stands before the place
        scan_of(wall_m=2.0),  # a wall does
        scan_of(wall_m=3.4),  # a wall is near it
        scan_of(one=2.9),  # one beam ends there
        scan_of(ahead=np.nan),  # beams were dropped
        scan_of(wide=False),  # the edge of the view cuts the floor where it may be
    ],
)
def test_all_else_says_nothing(scan: Scan) -> None:
    assert verdict(scan) == UNSEEN


def turned(first_rad: float, last_rad: float, mounted_rad: float = 0.0, range_max_m: float = 12.0) -> Scan:
    """Return a scan of a laser that sees nothing at all between two directions."""
    angles = np.linspace(first_rad, last_rad, 401)
    return Scan(
        stamp_ns=0, ranges_m=np.full(401, np.inf, dtype=np.float32), angle_min_rad=angles[0],
        angle_increment_rad=angles[1] - angles[0], range_max_m=range_max_m,
        T_base_laser=np.array([0.0, 0.0, mounted_rad]),
    )  # fmt: skip


def test_a_laser_looks_where_its_mounting_turns_it() -> None:
    left = np.array([0.0, 3.0])
    assert verdict(turned(-1.0, 1.0, np.pi / 2), left) == NOT_THERE
    assert verdict(turned(-1.0, 1.0, np.pi / 2)) == UNSEEN  # ahead of the robot, beside its laser's view


def test_the_view_of_a_laser_need_not_be_straight_ahead() -> None:
    in_the_middle, at_its_edge = (3.0 * np.array([np.cos(a), np.sin(a)]) for a in (1.0, 0.1))
    assert verdict(turned(0.0, 2.0), in_the_middle) == NOT_THERE
    assert verdict(turned(0.0, 2.0), at_its_edge) == UNSEEN


def test_nothing_is_known_of_places_at_the_end_of_a_lasers_range() -> None:
    assert verdict(turned(-1.0, 1.0, range_max_m=5.6)) == NOT_THERE
    assert verdict(turned(-1.0, 1.0, range_max_m=5.6), np.array([5.4, 0.0])) == UNSEEN
    assert verdict(turned(-1.0, 1.0, range_max_m=2.0)) == UNSEEN


def test_places_at_the_robot_and_far_away_are_not_looked_at() -> None:
    assert verdict(scan_of(), np.array([0.4, 0.0])) == UNSEEN
    assert verdict(scan_of(wall_m=11.0), np.array([7.0, 0.0])) == UNSEEN
