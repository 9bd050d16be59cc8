"""tf as it comes in: mountings, and poses at the moment of a scan."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.sim_driver.ros.frames import KEPT, MOVING_MOST, LiveFrames, RecentMotion
from mrslam.spatial import se2
from tests.sim_driver.ros.fakes import NS, transform


def test_a_pose_between_two_is_interpolated_along_the_short_turn() -> None:
    motion = RecentMotion()
    motion.add(0, np.array([0.0, 0.0, math.pi - 0.1]))
    motion.add(NS, np.array([2.0, 0.0, -math.pi + 0.1]))
    found = motion.at(NS // 2)
    assert found is not None and found[1] == 0
    assert abs(se2.wrap(found[0][2] - math.pi)) < 1e-9


def test_beyond_what_is_known_it_is_the_nearest_and_says_how_far() -> None:
    motion = RecentMotion()
    assert motion.at(0) is None
    for k in (1, 2):
        motion.add(k * NS, np.array([float(k), 0.0, 0.0]))
    newer, older = motion.at(5 * NS), motion.at(0)
    assert newer is not None and older is not None
    assert (newer[0][0], newer[1]) == (2.0, 3 * NS) and (older[0][0], older[1]) == (1.0, -NS)


def test_a_little_disorder_is_passed_over_and_a_jump_backward_begins_again() -> None:
    motion = RecentMotion()
    for stamp_ns, x_m in ((10 * NS, 1.0), (10 * NS - 1000, 9.0), (10 * NS, 9.0), (11 * NS, float("nan"))):
        motion.add(stamp_ns, np.array([x_m, 0.0, 0.0]))
    assert motion.newest_ns == 10 * NS
    motion.add(5 * NS, np.array([3.0, 0.0, 0.0]))
    found = motion.at(10 * NS)
    assert found is not None and found[0][0] == 3.0 and found[1] == 5 * NS


def test_memory_is_bounded() -> None:
    motion = RecentMotion()
    for k in range(5 * KEPT):
        motion.add(k, se2.IDENTITY)
    assert len(motion._stamps_ns) <= 2 * KEPT
    assert motion.newest_ns == 5 * KEPT - 1


def test_a_laser_is_mounted_through_all_frames_between() -> None:
    frames = LiveFrames("base_link")
    frames.add(transform("/base_link", "top", 0.0, 0.5, 0.0, math.pi / 2), is_static=True)
    frames.add(transform("top", "/laser", 0.0, 1.0, 0.0, 0.0, roll=math.pi), is_static=True)
    mounted = frames.mounting("base_link", "laser")
    assert mounted is not None
    np.testing.assert_allclose(mounted[0], [0.5, 1.0, math.pi / 2], atol=1e-9)
    assert mounted[1]
    assert frames.mounting("base_footprint", "laser") is None


def test_odometry_through_a_footprint_is_interpolated() -> None:
    frames = LiveFrames("base_link")
    frames.add(transform("base_footprint", "base_link", 0.0, 0.1, 0.0, 0.0), is_static=True)
    for k in (1, 2):
        frames.add(transform("odom", "base_footprint", float(k), 2.0 * k, 0.0, math.pi / 2), is_static=False)
    found = frames.pose("odom", "base_link", round(1.5 * NS))
    assert found is not None and found[1] == 0
    np.testing.assert_allclose(found[0], [3.0, 0.1, math.pi / 2], atol=1e-9)
    late = frames.pose("odom", "base_link", 3 * NS)
    assert late is not None and late[1] == NS
    assert frames.pose("map", "base_link", NS) is None


def test_broken_transforms_end_nothing() -> None:
    frames = LiveFrames("base_link")
    frames.add(transform("a", "b", 0.0, 0.0, 0.0, 0.0), is_static=True)
    frames.add(transform("b", "a", 0.0, 0.0, 0.0, 0.0), is_static=True)
    frames.add(transform("odom", "base_link", 0.0, float("nan"), 0.0, 0.0), is_static=False)
    frames.add(transform("c", "c", 0.0, 0.0, 0.0, 0.0), is_static=True)
    assert frames.pose("odom", "a", 0) is None
    assert frames.pose("odom", "base_link", 0) is None


@pytest.mark.parametrize("is_static", [True, False])
def test_the_newest_mounting_counts(is_static: bool) -> None:
    frames = LiveFrames("base_link")
    for k in (1, 2):
        frames.add(transform("base_link", "laser", float(k), float(k), 0.0, 0.0), is_static=is_static)
    mounted = frames.mounting("base_link", "laser")
    assert mounted is not None and mounted[0][0] == 2.0


def test_a_laser_beside_the_base_is_mounted_through_what_both_are_fixed_to() -> None:
    frames = LiveFrames("base_link")
    frames.add(transform("base_link", "base_footprint", 0.0, 0.1, 0.2, math.pi / 2), is_static=True)
    frames.add(transform("base_link", "laser", 0.0, 0.4, 0.2, math.pi / 2, roll=math.pi), is_static=True)
    mounted = frames.mounting("base_footprint", "laser")
    assert mounted is not None and mounted[1]
    np.testing.assert_allclose(mounted[0], [0.0, -0.3, 0.0], atol=1e-9)


@pytest.mark.parametrize("moving", ["base_link", "base_footprint"])
def test_what_does_not_move_with_the_base_is_not_mounted_on_it(moving: str) -> None:
    frames = LiveFrames("base_link")
    frames.add(transform("base_footprint", "base_link", 1.0, 0.0, 0.0, 0.0), is_static=moving != "base_link")
    frames.add(transform("odom", "base_footprint", 1.0, 3.0, 0.0, 0.0), is_static=moving != "base_footprint")
    frames.add(transform("odom", "wall", 0.0, 5.0, 0.0, 0.0), is_static=True)
    assert frames.mounting("base_link", "wall") is None


@pytest.mark.parametrize("x_m", [1.1e9, -1.1e9, 1e300])
def test_odometry_farther_than_any_robot_goes_is_passed_over(x_m: float) -> None:
    motion = RecentMotion()
    for k, pose in enumerate(([1.0, 0.0, 0.0], [x_m, 0.0, 0.0], [0.0, x_m, 0.0], [3.0, 0.0, 0.0])):
        motion.add(k * NS, np.array(pose))
    found = motion.at(2 * NS)
    assert found is not None and found[1] == 0
    np.testing.assert_allclose(found[0], [1.0 + 4.0 / 3.0, 0.0, 0.0])


@pytest.mark.parametrize(("x_m", "is_used"), [(3.0, True), (float("nan"), False), (1.1e9, False), (1e300, False)])
@pytest.mark.parametrize("is_static", [True, False])
def test_of_a_transform_it_is_said_whether_it_makes_sense(x_m: float, is_static: bool, is_used: bool) -> None:
    frames = LiveFrames("base_link")
    assert frames.add(transform("odom", "base_link", 1.0, x_m, 0.0, 0.0), is_static) is is_used
    assert (frames.pose("odom", "base_link", NS) is not None) is is_used
    for parent, child in (("", "base_link"), ("odom", ""), ("odom", "odom")):
        assert not frames.add(transform(parent, child, 1.0, 0.0, 0.0, 0.0), is_static)


def test_of_frames_that_come_and_go_for_ever_the_last_are_kept_and_those_the_base_moves_in() -> None:
    frames = LiveFrames("base_link")
    frames.add(transform("base_link", "laser", 0.0, 0.4, 0.0, 0.0), is_static=True)
    frames.add(transform("odom", "base_link", 1.0, 3.0, 0.0, 0.0), is_static=False)
    frames.add(transform("map", "person_0", 1.0, 1.0, 0.0, 0.0), is_static=False)
    for k in range(5 * MOVING_MOST):
        frames.add(transform("map", f"person_{k + 1}", 1.0, 1.0, 0.0, 0.0), is_static=False)
        frames.add(transform("map", "person_0", 1.0 + k, 1.0 + k, 0.0, 0.0), is_static=False)
    assert len(frames._moving) == MOVING_MOST and len(frames._parents) == len(frames._fixed) == MOVING_MOST + 1
    assert frames.pose("odom", "base_link", NS) is not None and frames.mounting("base_link", "laser") is not None
    always = frames.pose("map", "person_0", NS)
    assert always is not None and always[1] == 0  # heard again and again, and kept from its first pose on
    assert frames.pose("map", f"person_{k + 1}", NS) is not None and frames.pose("map", "person_1", NS) is None
