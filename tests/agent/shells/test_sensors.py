"""Scans from a robot's own drivers: what they may send, what becomes of it when the robot is slow."""

from __future__ import annotations

import json
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrslam.agent import SharedClock, WallClock
from mrslam.agent.shells.sensors import ODOMETRY_AGE_NS, SensorBody
from mrslam.comms.transport.sensors import decode_odometry, decode_scan, encode_odometry, encode_scan
from mrslam.spatial import InputError, Scan


def scan(stamp_ns: int = 5, value: float = 1.0) -> Scan:
    ranges = np.array([value, np.inf, np.nan], dtype=np.float32)
    return Scan(
        stamp_ns=stamp_ns, ranges_m=ranges, angle_min_rad=-1.0, angle_increment_rad=1.0, range_max_m=10.0,
        beam_interval_s=1e-4,
    )  # fmt: skip


def test_a_scan_survives_the_way() -> None:
    back, T_odom_base = decode_scan(encode_scan(scan(), np.array([1.0, 2.0, 3.0])))
    assert back.stamp_ns == 5 and back.beam_interval_s == 1e-4
    assert np.array_equal(back.ranges_m, scan().ranges_m, equal_nan=True)
    assert T_odom_base is not None and T_odom_base.tolist() == [1.0, 2.0, 3.0]
    stamp_ns, T_odom_base = decode_odometry(encode_odometry(7, np.array([1.0, 2.0, 3.0])))
    assert stamp_ns == 7 and T_odom_base.tolist() == [1.0, 2.0, 3.0]


def test_json_is_understood_and_null_is_no_return() -> None:
    text = {"stamp_ns": 1, "ranges_m": [1.5, None], "angle_min_rad": 0, "angle_increment_rad": 0.1, "range_max_m": 5}
    back, T_odom_base = decode_scan(json.dumps(text).encode())
    assert back.ranges_m.tolist() == [1.5, np.inf] and T_odom_base is None


@given(st.binary(max_size=200))
def test_anything_else_is_refused_in_words(payload: bytes) -> None:
    for decode in (decode_scan, decode_odometry):
        with pytest.raises(InputError):
            decode(payload)


def test_a_message_that_is_too_long_or_has_no_place_is_refused() -> None:
    with pytest.raises(InputError, match="is more than"):
        decode_scan(b"x" * 2_000_000)
    with pytest.raises(InputError, match="three finite numbers"):
        decode_odometry(encode_odometry(1, np.array([np.nan, 0.0, 0.0])))


def test_newest_scans_win_and_lost_ones_are_counted() -> None:
    body = SensorBody(WallClock())
    for k in range(5):
        body.on_scan(scan(stamp_ns=k))
    first, second = body.sense(0), body.sense(0)
    assert first is not None and second is not None and body.sense(0) is None
    assert (first.scan.stamp_ns, second.scan.stamp_ns, body.scans_lost) == (3, 4, 3)


def test_a_patient_body_keeps_scans_that_have_not_waited_long() -> None:
    clock, heard = SharedClock(SimpleNamespace(value=0)), []
    body = SensorBody(clock, patience_s=0.5, on_ready=lambda: heard.append(1))
    for k in range(5):
        clock.counter.value = k * 100_000_000
        body.on_scan(scan(stamp_ns=k))
    assert body.scans_lost == 0 and len(heard) == 5
    clock.counter.value = 500_000_000
    body.on_scan(scan(stamp_ns=5))
    first = body.sense(0)
    assert first is not None and (first.scan.stamp_ns, body.scans_lost) == (1, 1)


@pytest.mark.parametrize("order", [(0, 1, 2), (0, 2, 1), (2, 1, 0)])
def test_a_scan_gets_the_odometry_of_its_moment_in_whatever_order_it_comes(order: tuple[int, ...]) -> None:
    body = SensorBody(WallClock())
    for k in order:
        body.on_odometry(k * 100_000_000, np.array([float(k), 0.0, 0.0]))
    for stamp_ns, x_m in ((150_000_000, 1.5), (130_000_000, 1.3), (250_000_000, 2.0)):
        body.on_scan(scan(stamp_ns=stamp_ns))
        sensed = body.sense(0)
        assert sensed is not None and sensed.T_odom_base is not None
        assert sensed.T_odom_base[0] == pytest.approx(x_m)
    body.on_scan(scan(stamp_ns=10**12))
    sensed = body.sense(0)
    assert sensed is not None and sensed.T_odom_base is None  # too old to be this scan's
    own = np.array([9.0, 0.0, 0.0])
    body.on_scan(scan(stamp_ns=150_000_000), own)
    sensed = body.sense(0)
    assert sensed is not None and sensed.T_odom_base is own


def told_at(stamp_ns: int, *readings: tuple[int, list[float]]) -> np.ndarray | None:
    """Return the odometry that a scan of this stamp gets from readings of the wheels."""
    body = SensorBody(WallClock())
    for at_ns, pose in readings:
        body.on_odometry(at_ns, np.array(pose))
    body.on_scan(scan(stamp_ns=stamp_ns))
    sensed = body.sense(0)
    assert sensed is not None
    return sensed.T_odom_base


def test_wheels_that_were_heard_long_before_a_scan_say_nothing_of_it() -> None:
    near, far = ODOMETRY_AGE_NS - 1, ODOMETRY_AGE_NS + 1
    assert told_at(near, (0, [1.0, 2.0, 0.5])) == pytest.approx([1.0, 2.0, 0.5])
    assert told_at(far, (0, [1.0, 2.0, 0.5])) is None
    assert told_at(far, (0, [1.0, 2.0, 0.5]), (2 * far, [2.0, 2.0, 0.5])) is None


def test_a_heading_between_two_readings_goes_the_short_way_round() -> None:
    found = told_at(25_000_000, (0, [0.0, 0.0, 3.1]), (100_000_000, [0.0, 0.0, -3.1]))
    assert found is not None and found[2] == pytest.approx(3.1 + 0.25 * (2.0 * np.pi - 6.2))
