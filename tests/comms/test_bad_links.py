"""Real processes over links that lose, delay, crawl and break; skipped where no network namespace can be made."""

from __future__ import annotations

import os
import time

import numpy as np
import pytest

from comms import CommsConfig, ExchangeDone, ExchangeFailed, LinkChanged
from tests.comms.bad_link import BadLink
from tests.comms.processes import Robot
from tests.comms.team import big_map

CONFIG = CommsConfig(
    exchange_timeout_s=3.0,
    link_threshold=0.15,
    beacon_period_s=0.05,
    beacon_window=160,
    beacon_deadline_s=0.4,
    stall_timeout_s=5.0,
    retry_s=0.5,
    backoff_s=0.5,
    backoff_max_s=2.0,
    link_step=0.01,
)


MEASURED_S = 16.0
"""Both robots are listened to for half of it each: more than the beacons' window."""


@pytest.fixture
def link():
    try:
        made = BadLink(seed=1)
    except OSError as error:
        pytest.skip(f"network namespaces cannot be made here: {error}")
    yield made
    made.close()


def two_robots(link: BadLink, config: CommsConfig) -> list[Robot]:
    ends = [f"{protocol}/{link.addresses[0]}:{port}" for protocol, port in (("tcp", 7447), ("udp", 7448))]
    a = Robot("a", config=config, listen=ends, namespace=link.namespaces[0], local_map=big_map(400)).up()
    b = Robot("b", config=config, connect=ends, namespace=link.namespaces[1], local_map=big_map(400, seed=1)).up()
    return [a, b]


def know_each_other(robots: list[Robot], deadline_s: float) -> None:
    for robot in robots:
        robot.wait(lambda r: r[0] == "digest" and set(r[2]) == {"a", "b"}, "the other's map", deadline_s)
    digests = [[r[2] for r in robot.heard if r[0] == "digest"][-1] for robot in robots]
    assert digests[0] == digests[1]


CASES = {
    "clean": (0.0, 0.0, 1e9),
    "30 % lost": (0.3, 0.0, 1e9),
    "1 Mbit/s": (0.0, 0.02, 1e6),
    "10 % lost": (0.1, 0.0, 1e9),
    "50 % lost": (0.5, 0.0, 1e9),
    "200 ms": (0.0, 0.2, 1e9),
}
if "MRSLAM_SLOW" not in os.environ:
    CASES = dict(list(CASES.items())[1:3])


@pytest.mark.parametrize(("loss", "delay_s", "rate_bps"), CASES.values(), ids=list(CASES))
def test_link_quality_is_measured_and_maps_come_through(link, loss, delay_s, rate_bps):
    robots = two_robots(link, CONFIG)
    try:
        for robot in robots:  # both sessions are up
            robot.wait(lambda r: r[0] == "effect" and isinstance(r[2], LinkChanged) and r[2].quality > 0.3, "a link")
        link.loss, link.delay_s, link.rate_bps = loss, delay_s, rate_bps
        know_each_other(robots, 90)
        for robot in robots:
            robot.drain(MEASURED_S / 2)
        for robot in robots:
            assert mean_quality(robot, 4.0) == pytest.approx((1 - loss) ** 2, abs=0.1)
            ended = [r[2] for r in robot.heard if r[0] == "effect" and isinstance(r[2], ExchangeDone | ExchangeFailed)]
            assert any(isinstance(event, ExchangeDone) for event in ended)
            assert all(event.reason for event in ended)
    finally:
        for robot in robots:
            robot.stop()


def mean_quality(robot: Robot, seconds: float) -> float:
    """Return the mean over the last seconds of what the robot reported, which holds until the next report."""
    robot.drain(0.1)
    now = time.monotonic()
    reports = [(r[1], r[2].quality) for r in robot.heard if r[0] == "effect" and isinstance(r[2], LinkChanged)]
    ends = [*[t for t, _ in reports[1:]], now]
    spans = [max(0.0, end - max(t, now - seconds)) for (t, _), end in zip(reports, ends, strict=True)]
    return float(np.average([quality for _, quality in reports], weights=spans))


def test_a_link_that_comes_and_goes_still_brings_all(link):
    robots = two_robots(link, CONFIG)
    try:
        robots[0].effect(LinkChanged)
        link.rate_bps = 4e5
        end = time.monotonic() + 60
        while time.monotonic() < end and not all(
            any(r[0] == "digest" and len(r[2]) == 2 for r in robot.heard) for robot in robots
        ):
            link.up = not link.up
            for robot in robots:
                robot.drain(1.5)
        link.up = True
        know_each_other(robots, 30)
    finally:
        for robot in robots:
            robot.stop()


def test_a_link_below_the_threshold_is_left_alone(link):
    link.loss = 0.0
    robots = two_robots(
        link, CommsConfig(beacon_period_s=0.05, beacon_window=100, link_threshold=0.99, link_hysteresis=0.0)
    )
    try:
        link.loss = 0.3
        for robot in robots:
            robot.drain(4.0)
        for robot in robots:
            assert not [r for r in robot.heard if r[0] == "effect" and isinstance(r[2], ExchangeDone)]
    finally:
        for robot in robots:
            robot.stop()
