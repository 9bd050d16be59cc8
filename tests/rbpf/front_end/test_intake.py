"""What the front end is given of each scan: the motion that led to it, and the time since."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.front_end import FrontEnd
from mrslam.rbpf.front_end.intake import Intake, Reading
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
