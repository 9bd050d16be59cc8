from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrslam.comms import CommsConfig, LinkConditions, Send
from mrslam.comms.neighbours.beacon_clock import BeaconClock
from mrslam.comms.wire import messages as m
from tests.comms.team import QUICK, SECOND, Team

MEASURED = replace(QUICK, link_source="measured", beacon_period_s=0.5, link_threshold=0.15)


def beacons(team: Team, seconds: float) -> dict[str, list[m.Beacon]]:
    """Return the beacons each robot sends in this time."""
    sent: dict[str, list[m.Beacon]] = {robot: [] for robot in team.nodes}
    restore = {}
    for robot, end in team.ends.items():
        restore[robot] = end.send

        def send(effect: Send, robot=robot, send=end.send) -> None:
            if effect.lane == "beacon":
                sent[robot].append(m.decode(effect.payload, team.nodes[robot].team_tag, 1 << 16))
            send(effect)

        end.send = send
    team.run(seconds)
    for robot, send in restore.items():
        team.ends[robot].send = send
    return sent


def test_calm_links_and_lonely_robots_need_half_the_beacons():
    team = Team("ab", config=MEASURED)
    team.run(20)
    for sent in beacons(team, 20).values():
        assert len(sent) == 20
        assert {beacon.period_ms for beacon in sent} == {1000}
    alone = Team("a", config=MEASURED)
    assert len(beacons(alone, 20)["a"]) == 20


def test_a_link_that_loses_is_watched_at_the_full_rate():
    team = Team("ab", config=MEASURED)
    team.run(20)
    team.link = LinkConditions(loss=0.3)
    team.run(10)
    assert all(len(sent) >= 38 for sent in beacons(team, 20).values())


def test_who_comes_into_range_is_answered_at_once():
    team = Team("ab", config=MEASURED)
    team.groups = {"b": 1}
    team.run(100)
    assert all(len(sent) == 10 for sent in beacons(team, 10).values())  # out of range is as good as alone
    team.groups = {}
    team.run(1.5)
    assert all(len(sent) >= 8 for sent in beacons(team, 4).values())


def test_quality_means_the_same_at_either_pace():
    rng = np.random.default_rng(3)
    for loss in (0.05, 0.2):
        team = Team("ab", seed=int(rng.integers(99)), config=replace(MEASURED, link_smoothing=0.2))
        team.run(30)
        team.link = LinkConditions(loss=loss)
        team.run(60)
        measured = []
        for _ in range(100):
            team.run(1)
            measured.append(team.nodes["a"].rendezvous.peers["b"].quality)
        assert abs(np.mean(measured) - (1 - loss) ** 2) < 0.07


def test_a_beacon_is_small():
    team = Team("ab", config=MEASURED)
    for robot in "ab":
        team.start(robot, boot_id=1_700_000_000)
        team.nodes[robot].set_own_pose(np.array([12.345, -3.2, 1.5]), 0)
    team.run(20)
    before = team.nodes["a"].bytes_sent["beacon"]
    count = len(beacons(team, 60)["a"])
    assert (team.nodes["a"].bytes_sent["beacon"] - before) / count < 60


def test_the_pace_keeps_its_lattice_whenever_ticks_come():
    clock = BeaconClock(CommsConfig(beacon_period_s=0.5, beacon_calm_factor=1.0))
    times = []
    for now_ns in range(0, 10 * SECOND, SECOND // 13):
        if clock.is_due(now_ns, calm=False):
            clock.next(now_ns, calm=False)
            times.append(now_ns)
    assert len(times) == 20
    assert clock.seq == 20


def test_where_the_calm_ends_the_next_beacon_does_not_wait_for_the_calm_pace():
    clock = BeaconClock(CommsConfig(beacon_period_s=0.5, beacon_calm_factor=4.0))
    clock.next(0, calm=True)
    assert not clock.is_due(SECOND, calm=True)
    assert not clock.is_due(SECOND // 4, calm=False) and clock.is_due(SECOND // 2, calm=False)
