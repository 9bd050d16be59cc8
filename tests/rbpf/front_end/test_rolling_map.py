"""The map of the last few metres: what it shows, what it leaves behind."""

from __future__ import annotations

import numpy as np

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.prediction import PAUSE_MOST_M
from mrslam.rbpf.front_end.rolling_map import SCANS_KEPT, SCANS_MOST, RollingMap
from mrslam.spatial.matching.nearest import nearest
from mrslam.spatial.se2 import Transform, transform

CONFIG = MapperConfig(usable_range_m=5.0)
WALL = np.array([[1.0, 0.05 * k, -1.0, 0.0, 1.0] for k in range(-6, 7)])
"""A piece of wall a metre ahead, facing the robot."""


def shows_wall(map_: RollingMap, T_local_base: Transform) -> bool:
    """Return whether the map has the wall that a robot at a pose sees a metre ahead."""
    tiles = map_.tiles_around(T_local_base)
    x, y, theta = T_local_base
    x, y = (x + np.cos(theta)) / tiles.resolution_m, (y + np.sin(theta)) / tiles.resolution_m
    return bool(nearest(tiles, x, y, 0.0, 0.0, 0.0, 1).word != 0)


def driven(scans: int, step_m: float = 0.3) -> tuple[RollingMap, list[Transform]]:
    """Return the map of a robot that drove sideways along a wall of pieces, and its poses."""
    map_, poses = RollingMap(CONFIG), [transform(0.0, step_m * k, 0.0) for k in range(scans)]
    for pose in poses:
        map_.add(pose, WALL)
    return map_, poses


def test_a_scan_is_shown_where_it_was_seen_and_nowhere_else():
    map_ = RollingMap(CONFIG)
    assert map_.is_empty
    here, turned = transform(2.0, 3.0, 1.2), transform(2.0, 3.0, -1.2)
    map_.add(here, WALL)
    assert not map_.is_empty and shows_wall(map_, here) and not shows_wall(map_, turned)


def test_after_a_way_or_a_turn_a_scan_is_due():
    map_ = RollingMap(CONFIG)
    assert map_.is_due(transform(0.0, 0.0, 0.0))
    map_.add(transform(0.0, 0.0, 0.0), WALL)
    near, moved, turned = transform(0.1, 0.1, 0.1), transform(0.15, 0.15, 0.0), transform(0.0, 0.0, -0.2)
    assert [map_.is_due(pose) for pose in (near, moved, turned)] == [False, True, True]


def test_of_many_scans_the_newest_are_kept():
    map_, poses = driven(SCANS_MOST - 1)
    assert shows_wall(map_, poses[0])
    map_.add(transform(0.0, 0.3 * SCANS_MOST, 0.0), WALL)
    shown = [shows_wall(map_, pose) for pose in poses]
    assert not any(shown[: SCANS_MOST - SCANS_KEPT - 2]) and all(shown[SCANS_MOST - SCANS_KEPT :])


def test_what_is_cleared_is_empty():
    map_, poses = driven(3)
    map_.clear()
    assert map_.is_empty and not any(shows_wall(map_, pose) for pose in poses)


def test_a_map_drawn_again_shows_the_newest_scans_of_the_other_and_is_apart_from_it():
    other, poses = driven(40)
    map_ = RollingMap(CONFIG)
    map_.add(transform(0.0, -3.0, 0.0), WALL)
    map_.draw_again(other)
    shown = [shows_wall(map_, pose) for pose in poses]
    assert all(shown[-SCANS_KEPT:]) and not any(shown[: 40 - SCANS_KEPT - 1])
    assert not shows_wall(map_, transform(0.0, -3.0, 0.0))
    map_.add(transform(0.0, 13.0, 0.0), WALL)
    assert not shows_wall(other, transform(0.0, 13.0, 0.0))


def test_after_a_leap_the_map_begins_anew_and_its_window_stays_small():
    map_, poses = driven(5)
    before = map_.tiles_around(poses[-1]).table.size
    far = transform(1e4, -1e4, 0.0)
    tiles = map_.tiles_around(far)
    assert map_.is_empty and tiles.table.size < 4 * before
    map_.add(far, WALL)
    assert shows_wall(map_, far)


def test_a_scan_far_from_the_others_leaves_them_behind():
    map_, _ = driven(5)
    far = transform(2.0 * (CONFIG.usable_range_m + 2.0) + 2.0, 0.0, 0.0)
    assert far[0] < 2.0 * (CONFIG.usable_range_m + 2.0) + PAUSE_MOST_M
    map_.tiles_around(far)
    assert not map_.is_empty  # a motion that may be given up again
    map_.add(far, WALL)
    assert shows_wall(map_, far) and len(map_.state()["scans"]) == 1


def test_a_restored_map_shows_and_keeps_the_same():
    map_, poses = driven(SCANS_MOST - 1)
    other = RollingMap(CONFIG)
    other.restore(map_.state())
    newest = transform(0.0, 0.3 * SCANS_MOST, 0.0)
    for one in (map_, other):
        one.add(newest, WALL)
    assert [shows_wall(map_, pose) for pose in poses] == [shows_wall(other, pose) for pose in poses]
    assert shows_wall(other, newest)
