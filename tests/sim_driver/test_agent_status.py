"""What ``mrslam agent`` says of itself and decides without a process of its own: its status, its log, its record."""

from __future__ import annotations

import signal
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Agent, Event, Settings, WallClock
from mrslam.agent.chosen_frame import ChosenFrame
from mrslam.rbpf import MapperConfig
from mrslam.sim_driver.cli.live import agent as command
from mrslam.sim_driver.cli.live.agent import AgentOptions
from mrslam.sim_driver.cli.live.agent_status import status_of
from mrslam.sim_driver.feeds import Reading
from mrslam.sim_driver.run.known_area import KnownArea
from mrslam.sim_driver.simulation.recorded import RecordedBody
from mrslam.spatial import se2
from tests.agent.test_saved_maps import MONDAY, localise, robot_with_map, saved
from tests.rbpf.rooms import make_scan


def robot(mode: str = "distributed") -> Agent:
    return Agent("r1", Settings(rbpf=MapperConfig(particles=3)), team="team", mode=mode, seed=0, boot_id=1)


def asked(**more: Any) -> AgentOptions:
    options = AgentOptions(
        robot="r1", team="team", mode="distributed", listen=[], connect=[], multicast=False, keys=None, log=None,
        maps=[], near=None, sensors="", config=None, assignments=[], out=Path("r1"), fresh=False, duration_s=None,
        seed=0,
    )  # fmt: skip
    return replace(options, **more)


READINGS = [Reading(make_scan(np.array([0.1 * k, 0.0, 0.0]), k * 10**9), None) for k in range(4)]


def test_the_status_says_what_is_known_and_who_is_part_of_it() -> None:
    known = KnownArea()
    assert status_of(robot(), known, "no laser") == ("0 scans, 0 m2; 0 teammates here, merged nothing yet; no laser")
    assert "0 teammates here, merges nothing itself; " in status_of(robot("mapper"), known, "no laser")
    known.on_event(robot(), Event(0, "known", {"team_m2": 105.2, "placed": ["r1", "r2"]}))
    agent = robot()
    agent.on_scan(READINGS[0].scan, None, 0)
    assert status_of(agent, known, "no laser") == "1 scans, 105 m2 with r2; 0 teammates here; no laser"


def test_the_status_says_where_the_robot_is_in_a_saved_map_it_was_asked_for() -> None:
    agent = robot()
    agent.frame = ChosenFrame("office@monday")
    assert "yet, not localised in office@monday yet (the robot has no such map); " in status_of(agent, KnownArea(), "")
    agent.frame.T_frame_map = se2.transform(1.5, -2.0, np.pi / 2)
    assert ", at 1.50, -2.00 m, 90 deg in office@monday; " in status_of(agent, KnownArea(), "")


def test_the_status_says_why_the_robot_is_in_no_saved_map_yet() -> None:
    fresh = robot()
    fresh.take_saved_map("hall@monday", saved())
    assert "not localised in hall@monday yet (there is no map of the robot's own yet); " in status_of(
        fresh, KnownArea(), ""
    )
    agent = robot_with_map()
    agent.take_saved_map("hall@monday", saved())
    agent.team.beliefs["a", MONDAY].reason = "ambiguous: another place fits 84% as well; the best guess overlaps 58%"
    told = status_of(agent, KnownArea(), "")
    assert ", not localised in hall@monday yet (" in told
    assert told.endswith(f", not localised in {MONDAY} yet (ambiguous: another place fits 84% as well); ")
    agent.frame = ChosenFrame(MONDAY)
    told = status_of(agent, KnownArea(), "")
    assert told.count(MONDAY) == 1 and "another place fits 84% as well); " in told
    agent.team.beliefs["a", MONDAY].reason = "no place in it fits (overlap 20%, 40% is asked for; too little wall)"
    assert f"in {MONDAY} yet (no place in it fits); " in status_of(agent, KnownArea(), "")


def test_the_status_says_nothing_more_of_a_saved_map_where_the_robot_knows_its_place() -> None:
    agent = robot_with_map()
    localise(agent)
    assert MONDAY not in status_of(agent, KnownArea(), "")
    agent.frame = ChosenFrame(MONDAY)
    assert MONDAY not in status_of(agent, KnownArea(), "")  # its frame is known with the next tick
    agent.frame.T_frame_map = se2.transform(1.5, -2.0, np.pi / 2)
    assert status_of(agent, KnownArea(), "").count(MONDAY) == 1
    del agent.team.layout.T_team_map[MONDAY]  # lost there since: its frame stays where it was
    told = status_of(agent, KnownArea(), "")
    assert "in r1@monday" in told and told.count(MONDAY) == 1


def test_a_log_goes_on_after_the_last_scan_that_was_mapped() -> None:
    agent, body = robot(), RecordedBody(READINGS)
    assert command._skip_played(body, agent) is None and body.next_ns == 0
    for reading in READINGS[:2]:
        agent.on_scan(reading.scan, None, reading.scan.stamp_ns)
    assert command._skip_played(body, agent) == "the log continues after the last scan that the checkpoint holds"
    sensed = body.sense(0)
    assert sensed is not None and sensed.scan.stamp_ns == READINGS[2].scan.stamp_ns
    whole, other = RecordedBody(READINGS[:2]), RecordedBody(READINGS[2:])
    assert "played to its end before" in str(command._skip_played(whole, agent)) and whole.finished
    assert command._skip_played(other, agent) is None and not other.finished


@pytest.mark.parametrize("is_resumed", [False, True])
def test_a_map_is_as_old_as_its_first_start(tmp_path: Path, is_resumed: bool) -> None:
    options = asked(out=tmp_path)
    command._record(options, Settings(), None, [], 1000.0).write(tmp_path)
    past = [Event(0, "restarted", {"checkpoint": is_resumed})]
    assert command._record(options, Settings(), None, past, 2000.0).begun_s == (1000.0 if is_resumed else 2000.0)
    assert command._record(options, Settings(), None, [], 3000.0).begun_s == 3000.0  # with --fresh


@pytest.fixture
def handlers() -> Iterator[None]:
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def test_it_is_over_when_the_time_is_up_or_a_signal_came(handlers: None) -> None:
    with command._until_stopped(asked(duration_s=0.0), lambda: "") as over:
        assert over()
    for number in (signal.SIGINT, signal.SIGTERM):
        with command._until_stopped(asked(duration_s=3600.0), lambda: "") as over:
            assert not over()
            signal.raise_signal(number)
            assert over()


def test_a_base_station_has_no_laser_and_a_log_says_when_it_has_ended(data_dir: Path) -> None:
    clock = WallClock()
    with command._body(asked(mode="central"), None, clock) as (body, words):
        assert body.next_ns is None and words() == "no laser"
    log = data_dir / "multi_session" / "arena_raw_2.clf.gz"
    with command._body(asked(), log, clock) as (body, words):
        assert words() == "playing the log"
        assert isinstance(body, RecordedBody)
        body.skip_to(2**62)
        assert words() == "the log has ended"
