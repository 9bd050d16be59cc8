from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf import MapperConfig
from mrslam.rbpf.front_end.sight import Sight
from mrslam.spatial import Scan

MOUNTED = np.array([0.2, 0.0, 0.1])
"""Pose of the laser on the robot."""


def swept(velocity: np.ndarray, interval_s: float, first_rad: float, step_rad: float) -> Scan:
    """What a laser sees of a wall at y = 2 m while the robot drives and turns; beam after beam, no shear left out."""
    ranges = np.full(512, np.nan)
    for k in range(ranges.size):
        _, y, theta = velocity * k * interval_s
        laser_y = y + np.sin(theta) * MOUNTED[0]
        slope = np.sin(theta + MOUNTED[2] + first_rad + k * step_rad)
        if slope > 0.3:
            ranges[k] = (2.0 - laser_y) / slope
    return Scan(
        stamp_ns=0, ranges_m=ranges.astype(np.float32), angle_min_rad=first_rad, angle_increment_rad=step_rad,
        range_max_m=8.0, T_base_laser=MOUNTED, beam_interval_s=interval_s,
    )  # fmt: skip


@pytest.mark.parametrize("first_rad, step_rad", [(-1.5, 0.006), (1.6, -0.006), (0.1, 0.012)])
@pytest.mark.parametrize("velocity", [(0.8, 0.0, 0.0), (0.3, 0.0, -0.6), (-0.4, 0.0, 0.9)])
def test_a_wall_swept_on_the_move_becomes_straight(
    velocity: tuple[float, float, float], first_rad: float, step_rad: float
) -> None:
    speed = np.array(velocity)
    scan = swept(speed, 2e-4, first_rad, step_rad)
    sight = Sight(MapperConfig())
    points = sight.points(scan).copy()
    bent = np.abs(points[:, 1] - 2.0).max()
    sight.straighten(points, scan, speed)
    assert points.shape[0] > 100
    assert np.abs(points[:, 1] - 2.0).max() < min(0.004, 0.25 * bent + 0.001)
    assert np.hypot(points[:, 2], points[:, 3]) == pytest.approx(np.ones(points.shape[0]), abs=1e-6)


def test_a_laser_that_tells_no_times_is_left_alone() -> None:
    scan = swept(np.array([0.8, 0.0, 0.0]), 0.0, -1.5, 0.006)
    sight = Sight(MapperConfig())
    points = sight.points(scan).copy()
    before = points.copy()
    sight.straighten(points, scan, np.array([0.8, 0.0, 0.0]))
    assert np.array_equal(points, before)


def test_beams_without_a_return_clear_no_farther_than_the_laser_sees() -> None:
    sight, scan = Sight(MapperConfig(clear_range_m=10.0)), swept(np.zeros(3), 0.0, -1.0, 0.01)
    none = scan.with_ranges(np.full(scan.ranges_m.size, np.inf))
    sight.points(none)
    ends = sight.clearing_ends(none) - none.T_base_laser[:2]
    assert np.hypot(*ends.T) == pytest.approx(min(10.0, none.range_max_m))


def test_each_point_is_put_back_by_the_time_of_its_beam_wherever_the_laser_sits() -> None:
    corner, velocity = np.array([0.9, -0.6, 0.4]), np.array([0.5, -0.2, 0.0])
    scan = Scan(
        stamp_ns=0, ranges_m=np.full(300, 1.5, dtype=np.float32), angle_min_rad=-1.5, angle_increment_rad=0.01,
        range_max_m=8.0, T_base_laser=corner, beam_interval_s=1e-3,
    )  # fmt: skip
    sight = Sight(MapperConfig())
    points = sight.points(scan)
    before = points[:, :2].copy()
    sight.straighten(points, scan, velocity)
    assert points[:, :2] - before == pytest.approx(np.arange(300)[:, None] * 1e-3 * velocity[:2], abs=1e-5)


def test_a_scan_of_other_bearings_is_seen_as_by_a_robot_that_saw_no_other_before() -> None:
    sight, ranges_m = Sight(MapperConfig(clear_range_m=5.0)), np.full(200, 2.0, dtype=np.float32)
    ranges_m[::3] = np.inf
    for first_rad, step_rad, count in ((-1.0, 0.01, 200), (0.5, 0.01, 200), (0.5, -0.01, 200), (0.5, -0.01, 150)):
        scan = Scan(
            stamp_ns=0, ranges_m=ranges_m[:count], angle_min_rad=first_rad, angle_increment_rad=step_rad,
            range_max_m=8.0, T_base_laser=MOUNTED,
        )  # fmt: skip
        alone = Sight(MapperConfig(clear_range_m=5.0))
        assert np.array_equal(sight.points(scan), alone.points(scan))
        assert np.array_equal(sight.clearing_ends(scan), alone.clearing_ends(scan))


def test_a_scan_is_matched_by_no_more_beams_than_are_asked_for() -> None:
    scan = swept(np.zeros(3), 0.0, -1.5, 0.006)
    for most in (20, 60, 512):
        sight = Sight(MapperConfig(beams_match=most))
        points = sight.points(scan)
        count = len(sight.sample(points, scan.T_base_laser))
        assert 0.4 * min(most, len(points)) < count <= most
    assert count > 60  # there are more points than that
