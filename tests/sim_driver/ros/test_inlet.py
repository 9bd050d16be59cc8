"""From messages to scans: mountings, odometry of the moment, and one warning for each kind of trouble."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.ros.complaints import Complaints
from mrslam.sim_driver.ros.inlet import HELD, JUMP_PAUSE_S, MOUNTING_WAIT_S, ODOMETRY_WAIT_S, QUIET_S, Inlet
from mrslam.sim_driver.ros.options import RosOptions
from mrslam.spatial import Scan
from mrslam.spatial.se2 import Transform
from tests.sim_driver.ros.fakes import NS, odometry, scan, tf, transform
from tests.sim_driver.ros.test_outlook import make_agent, ranges_in_room


class Rig:
    """An inlet with what it said, and what it handed on."""

    def __init__(self, **options: Any) -> None:
        self.said: list[str] = []
        self.out: list[tuple[Scan, Transform | None]] = []
        self.jumps: list[float] = []
        self.now_s = 0.0
        self.inlet = Inlet(
            RosOptions(robot="r1", **options),
            lambda scan, T: self.out.append((scan, T)),
            Complaints(self.said.append),
            0.0,
            self.jumps.append,
        )

    def mounted(self, x: float = 0.2) -> Rig:
        self.inlet.take_transforms(tf(transform("base_link", "laser", 0.0, x, 0.0, 0.0)), True, self.now_s)
        return self

    def wheels(self, stamp_s: float, x: float, **more: Any) -> None:
        self.inlet.take_odometry(odometry(stamp_s, x, **more), 0, self.now_s)

    def tf(self, stamp_s: float, x: float) -> None:
        self.inlet.take_transforms(tf(transform("odom", "base_link", stamp_s, x, 0.0, 0.0)), False, self.now_s)

    def scan(self, stamp_s: float, topic: str = "scan", **more: Any) -> None:
        self.inlet.take_scan(topic, scan(stamp_s, **more), 0, self.now_s)

    def at(self, now_s: float) -> None:
        self.now_s = now_s
        self.inlet.pump(now_s)


def test_a_scan_waits_for_odometry_newer_than_itself() -> None:
    rig = Rig().mounted()
    rig.wheels(10.0, 1.0)
    rig.scan(10.05)
    assert not rig.out
    rig.wheels(10.1, 2.0)
    ((taken, T_odom_base),) = rig.out
    assert T_odom_base is not None and T_odom_base[0] == pytest.approx(1.5)
    assert taken.stamp_ns == round(10.05 * NS) and taken.T_base_laser[0] == pytest.approx(0.2)


def test_it_does_not_wait_for_long_nor_for_odometry_that_ended() -> None:
    rig = Rig().mounted()
    rig.wheels(10.0, 1.0)
    rig.scan(10.05)
    rig.at(ODOMETRY_WAIT_S + 0.01)
    assert len(rig.out) == 1 and rig.out[0][1] is not None
    rig.scan(15.0)
    assert len(rig.out) == 2 and rig.out[1][1] is None
    assert len(rig.said) == 1 and "odometry (topic) is 5.0 s away" in rig.said[0]


def test_without_any_odometry_scans_are_handed_on_at_once() -> None:
    rig = Rig().mounted()
    rig.scan(10.0)
    assert [T for _, T in rig.out] == [None]


def test_tf_counts_more_than_the_topic_and_a_change_between_them_is_no_motion() -> None:
    rig = Rig().mounted()
    rig.wheels(10.0, 100.0)
    rig.scan(10.0)
    rig.tf(10.1, 3.0)
    rig.wheels(10.1, 101.0)
    rig.scan(10.1)
    rig.tf(10.2, 4.0)
    rig.scan(10.2)
    assert [None if T is None else T[0] for _, T in rig.out] == [100.0, None, 4.0]


@pytest.mark.parametrize(("source", "expected"), [("tf", 3.0), ("topic", 100.0), ("none", None)])
def test_the_source_of_odometry_can_be_chosen(source: str, expected: float | None) -> None:
    rig = Rig(odometry=source).mounted()
    rig.tf(10.0, 3.0)
    rig.wheels(10.0, 100.0)
    rig.scan(10.0)
    (T_odom_base,) = [T for _, T in rig.out]
    assert (None if T_odom_base is None else T_odom_base[0]) == expected


def test_the_first_scans_wait_for_their_mounting_and_none_is_lost() -> None:
    rig = Rig()
    for k in range(15):
        rig.at(0.1 * k)
        rig.scan(10.0 + 0.1 * k)
    assert not rig.out
    rig.mounted(0.3)
    assert len(rig.out) == 15 and all(taken.T_base_laser[0] == pytest.approx(0.3) for taken, _ in rig.out)
    assert not rig.said


def test_a_frame_that_tf_does_not_know_is_named_once_and_nothing_is_lost() -> None:
    rig = Rig().mounted()
    for k in range(60):
        rig.at(0.1 * k)
        rig.scan(10.0 + 0.1 * k, frame="lazer")
        assert len(rig.out) == (0 if 0.1 * k < MOUNTING_WAIT_S else k + 1)  # only the first ones wait
    assert len(rig.out) == 60 and all(not taken.T_base_laser.any() for taken, _ in rig.out)
    assert len(rig.said) == 1 and "how 'lazer' is mounted on 'base_link'" in rig.said[0]


def test_two_lasers_have_their_own_mountings() -> None:
    rig = Rig(scan_topics=("front", "rear")).mounted(0.2)
    back = transform("base_link", "back", 0.0, -0.3, 0.0, math.pi, roll=math.pi)
    rig.inlet.take_transforms(tf(back), True, 0.0)
    rig.scan(10.0, "front", ranges=[math.nan] * 50 + [2.0] + [math.nan] * 49)  # straight on
    rig.scan(10.01, "rear", frame="back", ranges=[2.0] + [math.nan] * 99)  # its first beam: -1 rad, upside down
    rig.scan(10.1, "front", ranges=[math.nan] * 50 + [2.0] + [math.nan] * 49)
    (alone, _), (both, _) = rig.out
    assert [one.stamp_ns for one in (alone, both)] == [10 * NS, round(10.1 * NS)]
    np.testing.assert_allclose(alone.points_base(), [[2.2, 0.0]], atol=0.02)
    behind = [-0.3 - 2.0 * math.cos(1.0), -2.0 * math.sin(1.0)]
    np.testing.assert_allclose(both.points_base(), [behind, [2.2, 0.0]], atol=0.02)


def test_stamps_that_run_backward_are_said_once_and_mapped_without_a_step_of_odometry() -> None:
    rig = Rig().mounted()
    for begin_s in (100.0, 10.0, 10.0):  # a bag of one second that loops twice
        for k in range(11):
            rig.wheels(begin_s + 0.1 * k, 0.1 * k)
            rig.scan(begin_s + 0.1 * k)
    assert len(rig.out) == 33
    assert [k for k, (_, T) in enumerate(rig.out) if T is None] == [11]
    assert rig.jumps == [pytest.approx(91.0)]
    assert len(rig.said) == 1 and "run backward by 91.0 s" in rig.said[0]


@pytest.mark.parametrize(
    ("changed", "words", "is_used"),
    [
        ({"ranges": [float("nan")] * 100}, "without any finite range", True),
        ({"ranges": [2.0] * 50}, "scans of 100 and of 50 beams", True),
        ({"angle_increment": float("nan")}, "make no sense are dropped: angle_increment_rad must be finite", False),
        ({"range_max": 0.0}, "need 0 <= range_min_m < range_max_m", False),
    ],
)
def test_odd_scans_are_named_once(changed: dict[str, Any], words: str, is_used: bool) -> None:
    rig = Rig().mounted()
    rig.scan(10.0)
    for k in range(1, 4):
        rig.scan(10.0 + 0.1 * k, **changed)
    rig.scan(11.0)
    assert len(rig.out) == (5 if is_used else 2)
    assert len(rig.said) == 1 and words in rig.said[0]


def test_odometry_that_is_not_finite_or_of_another_frame_is_named_once() -> None:
    rig = Rig().mounted()
    for k in range(3):
        rig.wheels(10.0 + 0.1 * k, float("nan"))
        rig.wheels(10.0 + 0.1 * k, 1.0, child="wheels")
    rig.scan(10.0)
    assert len(rig.said) == 2
    assert any("not finite" in words for words in rig.said)
    assert any("'wheels'" in words and "'base_link'" in words for words in rig.said)
    assert rig.out[0][1] is not None


@pytest.mark.parametrize("x_m", [float("nan"), 1e300])
@pytest.mark.parametrize("source", ["tf", "topic"])
def test_odometry_that_makes_no_sense_is_named_and_counted_and_is_none(source: str, x_m: float) -> None:
    rig = Rig().mounted()
    for k in range(round(QUIET_S) + 3):
        rig.at(float(k))
        rig.tf(10.0 + k, x_m) if source == "tf" else rig.wheels(10.0 + k, x_m)
        rig.scan(10.0 + k)
        rig.inlet.watch_silence(rig.now_s)
    bad, none = rig.said
    assert "not finite, " in bad and ("'odom' -> 'base_link'" if source == "tf" else "odom: poses") in bad
    assert "but no odometry" in none and len(rig.out) == k + 1
    assert rig.inlet._complaints.counts["bad tf" if source == "tf" else "bad odometry"] == k + 1
    assert (rig.inlet.arrivals.odometry, rig.inlet.arrivals.transforms) == (0, 0)


@pytest.mark.parametrize(("what", "words"), [("scan", "but no odometry"), ("wheels", "but no scan on scan")])
def test_one_without_the_other_is_said_once(what: str, words: str) -> None:
    rig = Rig().mounted()
    for k in range(round(QUIET_S) + 3):
        rig.at(float(k))
        rig.scan(10.0 + k) if what == "scan" else rig.wheels(10.0 + k, 0.0)
        rig.inlet.watch_silence(rig.now_s)
    assert len(rig.said) == 1 and words in rig.said[0]


def test_a_prefix_is_put_before_the_frames_that_are_looked_up() -> None:
    rig = Rig(frame_prefix="r1/")
    mount = transform("r1/base_link", "r1/laser", 0.0, 0.4, 0.0, 0.0)
    rig.inlet.take_transforms(tf(mount), True, 0.0)
    rig.inlet.take_transforms(tf(transform("r1/odom", "r1/base_link", 10.0, 7.0, 0.0, 0.0)), False, 0.0)
    rig.scan(10.0, frame="r1/laser")
    ((taken, T_odom_base),) = rig.out
    np.testing.assert_allclose(taken.T_base_laser, [0.4, 0.0, 0.0])
    assert T_odom_base is not None and T_odom_base[0] == 7.0


def test_two_lasers_make_one_map() -> None:
    """One looks forward and one, mounted behind it upside down, backward; they send by turns."""
    agent = make_agent()
    inlet = Inlet(
        RosOptions(robot="r1", scan_topics=("front", "rear")),
        lambda taken, T: agent.on_scan(taken, T, taken.stamp_ns) and None,
        Complaints(lambda words: pytest.fail(words)),
        0.0,
    )
    front = transform("base_link", "front", 0.0, 0.2, 0.0, 0.0)
    rear = transform("base_link", "rear", 0.0, -0.3, 0.0, math.pi, roll=math.pi)
    inlet.take_transforms(tf(front, rear), True, 0.0)
    angles = np.linspace(-1.5, 1.5, 200)
    for k in range(120):
        x_m, stamp_s = 0.01 * k, 1.0 + 0.05 * k
        inlet.take_odometry(odometry(stamp_s, x_m), 0, 0.0)
        name, at_m, way = ("front", x_m + 0.2, 0.0) if k % 2 == 0 else ("rear", x_m - 0.3, math.pi)
        ranges = ranges_in_room(at_m, angles if k % 2 == 0 else way - angles)
        seen = scan(stamp_s, list(ranges), name, angle_min=-1.5, angle_increment=3.0 / 199, range_max=20.0)
        inlet.take_scan(name, seen, 0, 0.0)
    np.testing.assert_allclose(agent.mapper.T_map_base, [1.18, 0.0, 0.0], atol=0.05)
    assert agent.mapper.stats.scans == 60 and agent.mapper.stats.dropped == 0
    grid = agent.own_map()
    walls = grid.centres(grid.is_occupied)
    assert np.abs(walls[:, 0]).max() < 3.1 and walls[:, 0].min() < -2.9 and walls[:, 0].max() > 2.9
    assert np.abs(walls[:, 1]).max() < 2.1


def test_of_too_many_scans_that_wait_the_oldest_is_handed_on_and_not_lost() -> None:
    rig = Rig()
    for k in range(HELD + 2):
        rig.scan(10.0 + 0.001 * k)
    assert [taken.stamp_ns for taken, _ in rig.out] == [10 * NS, round(10.001 * NS)]


def test_odometry_that_lives_counts_more_than_tf_that_died() -> None:
    rig = Rig().mounted()
    rig.tf(10.0, 3.0)
    rig.wheels(12.0, 100.0)
    rig.scan(12.0)
    ((_, T_odom_base),) = rig.out
    assert T_odom_base is not None and T_odom_base[0] == 100.0 and not rig.said


def test_scans_that_wait_are_handed_on_before_a_jump_of_the_clock_is_told() -> None:
    rig, at_jump = Rig().mounted(), list[int]()
    rig.inlet._on_jump = lambda seconds: at_jump.append(len(rig.out))
    rig.wheels(100.0, 1.0)
    rig.scan(100.05)
    assert not rig.out  # it waits for odometry
    rig.scan(3.0)
    assert at_jump == [1]


def test_two_drivers_of_different_clocks_on_one_topic_ask_for_one_session_and_a_later_jump_for_another() -> None:
    rig = Rig(odometry="none").mounted()
    for k in range(200):  # for longer than the pause
        rig.at(0.5 * k)
        rig.scan(1000.0 + 0.5 * k)
        rig.scan(900.0 + 0.5 * k)
    assert rig.jumps == [pytest.approx(100.0)] and len(rig.out) == 400
    rig.at(rig.now_s + JUMP_PAUSE_S + 1.0)
    rig.scan(500.0)
    assert len(rig.jumps) == 2
