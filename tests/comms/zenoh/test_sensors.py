"""A robot's own drivers and its agent, over Zenoh on one machine."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable
from types import SimpleNamespace

import numpy as np
import pytest

from mrslam.comms.transport.sensors import decode_odometry, encode_odometry
from mrslam.comms.zenoh import SensorPublisher, ZenohSensors
from mrslam.spatial import Scan
from tests.comms.processes import free_port

DEADLINE_S = 60.0
"""Longest wait for what must come, seconds: all runs in this process."""
SCAN = Scan(stamp_ns=5, ranges_m=np.ones(3, np.float32), angle_min_rad=-1.0, angle_increment_rad=1.0, range_max_m=10.0)


@pytest.fixture
def driven():
    """A driver, its agent's end, and what that hands over."""
    endpoint, heard = f"tcp/127.0.0.1:{free_port()}", queue.SimpleQueue()
    sensors = ZenohSensors("a", "team", endpoint, lambda *scan: heard.put(scan), lambda *odom: heard.put(odom))
    driver = SensorPublisher("a", "team", endpoint)
    yield driver, sensors, heard
    driver.close()
    sensors.close()


def until_heard(give: Callable[[], None], is_heard: Callable[[], bool]) -> None:
    """Give again and again: what is sent before the two have found each other is lost."""
    end = time.monotonic() + DEADLINE_S
    while not is_heard():
        assert time.monotonic() < end
        give()
        time.sleep(0.02)


def test_scans_and_odometry_come_with_their_poses(driven):
    driver, _, heard = driven
    until_heard(lambda: driver.scan(SCAN, np.array([1.0, 2.0, 3.0])), lambda: not heard.empty())
    scan, T_odom_base = heard.get()
    assert scan.stamp_ns == 5 and T_odom_base.tolist() == [1.0, 2.0, 3.0]
    until_heard(
        lambda: driver.odometry(7, np.array([4.0, 5.0, 6.0])),
        lambda: not heard.empty() and isinstance((taken := heard.get())[0], int) and taken[1].tolist() == [4, 5, 6],
    )


def test_a_message_that_is_none_is_counted_and_the_next_one_taken(driven, caplog):
    driver, sensors, heard = driven
    until_heard(lambda: driver._scan.put(b"no scan"), lambda: bool(sensors.dropped))
    assert heard.empty() and set(sensors.dropped) == {"scan"}
    assert "1 messages (scan) of a driver were dropped, the last: no ScanMessage" in caplog.text
    until_heard(lambda: driver.scan(SCAN), lambda: not heard.empty())


def test_bad_messages_are_counted_by_kind_whatever_numbers_are_in_them_and_not_all_are_logged(driven, caplog):
    _, sensors, heard = driven
    take = sensors._guarded("odometry", lambda raw: heard.put(decode_odometry(raw)))
    for k in range(1, 7):
        raw = encode_odometry(k, np.array([float(k), 0.0, np.nan]))
        take(SimpleNamespace(payload=SimpleNamespace(to_bytes=lambda raw=raw: raw)))
    assert sensors.dropped == {"odometry": 6} and heard.empty()
    assert [message.split()[0] for message in caplog.messages] == ["1", "2", "4"]
    assert "the last: a pose must be three finite numbers, got (4.0, 0.0, nan)" in caplog.text
