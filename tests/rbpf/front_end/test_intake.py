"""What the front end is given of each scan: the motion that led to it, and the time since."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.front_end import FrontEnd
from mrslam.rbpf.front_end.intake import Intake, Reading
from mrslam.spatial import se2
from tests.rbpf.rooms import make_scan


def taken(intake: Intake, k: int) -> Reading:
    """Take the ``k``-th of some scans, which are 0.1 m and 0.1 s apart."""
    pose = np.array([0.1 * k, 0.0, 0.0])
    return intake.take(make_scan(pose, k * 10**8, fov=2 * np.pi), pose)


def test_the_motion_to_a_scan_that_is_left_out_is_part_of_that_to_the_next() -> None:
    config = MapperConfig(particles=1, threads=1)
    intake = Intake(config, FrontEnd(config))
    taken(intake, 0)
    assert taken(intake, 1).odom_motion == pytest.approx([0.1, 0.0, 0.0])
    taken(intake, 2)
    assert intake.put_back()
    after = taken(intake, 4)  # from the one before
    assert after.odom_motion == pytest.approx([0.3, 0.0, 0.0]) and after.elapsed_s == pytest.approx(0.3)
    assert not intake.put_back()  # of two in a row the second is used
    assert taken(intake, 5).odom_motion == pytest.approx([0.1, 0.0, 0.0])
    intake.matched(after, np.zeros(3))
    assert intake.put_back() and taken(intake, 6).odom_motion == pytest.approx([0.2, 0.0, 0.0])


def test_a_scan_is_not_left_out_again_by_an_intake_that_was_resumed() -> None:
    config = MapperConfig(particles=1, threads=1)
    intake = Intake(config, FrontEnd(config))
    for k in range(2):
        reading = taken(intake, k)
    fresh = Intake(config, FrontEnd(config))
    fresh.restore(intake.state())
    assert fresh.put_back()
    assert intake.put_back()
    again = Intake(config, FrontEnd(config))
    again.restore(intake.state())
    assert taken(again, 3).odom_motion == pytest.approx([0.3, 0.0, 0.0])
    assert not again.put_back()
    again.matched(reading, np.zeros(3))
    assert again.put_back()


@pytest.mark.parametrize("told", [[np.nan, 0.0, 0.0], [0.1, np.inf, 0.0], [0.1, 0.0], [[0.1, 0.0, 0.0]]])
def test_odometry_that_is_no_pose_is_none(told: list[float]) -> None:
    config = MapperConfig(particles=1, threads=1)
    intake = Intake(config, FrontEnd(config))
    taken(intake, 0)
    reading = intake.take(make_scan(np.array([0.1, 0.0, 0.0]), 10**8, fov=2 * np.pi), np.array(told))
    assert reading.odom_motion is None and reading.reason is None and intake.T_odom_base is None
    assert taken(intake, 2).odom_motion is None and taken(intake, 3).odom_motion == pytest.approx([0.1, 0.0, 0.0])


ARC = np.array([0.1, 0.01, 0.1])
"""Motion from one scan to the next, 0.1 s apart."""
LEAP = np.array([1.0, 2.0, 0.4])


def on_an_arc(refused: set[int], leaps: int, step: np.ndarray = LEAP, *, resumed: bool = False) -> np.ndarray:
    """Return the motion from the scan 3 to the scan 7, ``refused`` ones between, where odometry leaps at ``leaps``."""
    config = MapperConfig(particles=1, threads=1)
    intake = Intake(config, FrontEnd(config))
    pose = np.zeros(3)
    for k in range(8):
        told = pose if k < leaps else se2.compose(step, pose)
        scan = make_scan(pose, k * 10**8, fov=2 * np.pi)
        if k in refused:
            scan = replace(scan, ranges_m=np.full_like(scan.ranges_m, np.inf))
        if resumed and k == leaps:
            state, intake = intake.state(), Intake(config, FrontEnd(config))
            intake.restore(state)
        reading = intake.take(scan, told)
        assert (reading.reason is not None) == (k in refused)
        pose = se2.compose(pose, ARC)
    assert reading.odom_motion is not None
    return reading.odom_motion


def arc(steps: int) -> np.ndarray:
    """Return the motion of some steps."""
    motion = np.zeros(3)
    for _ in range(steps):
        motion = se2.compose(motion, ARC)
    return motion


@pytest.mark.parametrize("leaps", [4, 5, 6, 7])
@pytest.mark.parametrize("resumed", [False, True])
def test_a_leap_of_odometry_beside_a_scan_that_is_refused_is_left_out(leaps: int, resumed: bool) -> None:
    assert on_an_arc({4, 5, 6}, leaps, resumed=resumed) == pytest.approx(arc(4), abs=1e-9)


def test_a_leap_between_two_scans_that_are_used_is_left_to_the_match() -> None:
    assert np.linalg.norm(on_an_arc(set(), 7) - ARC) > 1.0


def test_a_step_that_a_robot_can_make_is_no_leap() -> None:
    slid = on_an_arc({4, 5, 6}, 5, np.array([0.1, 0.2, 0.0]))
    assert np.linalg.norm(slid - arc(4)) > 0.15


def test_what_comes_after_a_leap_is_told_from_there() -> None:
    config = MapperConfig(particles=1, threads=1)
    intake = Intake(config, FrontEnd(config))
    blind = make_scan(np.zeros(3), 0, fov=2 * np.pi)
    blind = replace(blind, ranges_m=np.full_like(blind.ranges_m, np.inf))
    taken(intake, 0)
    assert intake.take(replace(blind, stamp_ns=10**8), None).odom_motion is None  # nothing is told at this one
    told = np.array([50.0, 0.0, 0.0])
    intake.take(replace(blind, stamp_ns=2 * 10**8), told)
    far = intake.take(make_scan(told, 3 * 10**8, fov=2 * np.pi), told).odom_motion
    assert far == pytest.approx([50.0, 0.0, 0.0])  # nobody knows when it came there
