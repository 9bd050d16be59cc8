"""``mrslam ros`` from its start to its end, with a stand-in for the node where ROS is not installed."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Agent, AgentConfig, Event, Settings
from mrslam.comms import make_team_keys
from mrslam.comms.transport.local_robots import local_robots
from mrslam.rbpf import MapperConfig
from mrslam.sim_driver.cli.live.ros import MergeMessages, _make_agent, _run
from mrslam.sim_driver.missions.agent_record import AgentRecord
from mrslam.sim_driver.missions.usage import read_usage
from mrslam.sim_driver.ros.options import RosOptions
from mrslam.sim_driver.ros.outlook import RosBody
from mrslam.sim_driver.ros.sessions import Sessions
from mrslam.spatial import InputError
from tests.comms.processes import free_port
from tests.sim_driver.ros.test_outlook import room

DEADLINE_S = 300.0
SETTINGS = Settings(rbpf=MapperConfig(particles=3), agent=AgentConfig(checkpoint_interval_s=1800.0))


@pytest.fixture(autouse=True)
def alone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only this test's robot is on this machine."""
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))


class Node:
    """What the command needs of a node: options, a log, and one who drives each time it asks whether to stop."""

    def __init__(self, folder: Path | str, settings: Settings = SETTINGS, **options: Any) -> None:
        given = {
            "robot": "r1",
            "team": "depot",
            "listen": (f"tcp/127.0.0.1:{free_port()}",),
            "out": str(folder),
        } | options
        self.options, self.settings = RosOptions(**given), settings
        self.said: list[str] = []
        self.warned: list[str] = []
        self.scans = 0

    def say(self, words: str) -> None:
        self.said.append(words)

    def warn(self, words: str) -> None:
        self.warned.append(words)

    def now_ns(self) -> int:
        return time.monotonic_ns()

    def connect(self, body: RosBody, sessions: Sessions, folder: Path) -> None:
        self.body, self.sessions, self.folder = body, sessions, folder

    def drive(self) -> None:
        """Give a scan of a room in which the robot drives 3 cm a scan."""
        x_m = 0.03 * self.scans
        self.body.take(room(self.scans * 100_000_000, x_m), np.array([x_m, 0.0, 0.0]))
        self.scans += 1

    def run(self, scans: int, then: Callable[[int], None] = lambda times: None) -> None:
        """Run until so many scans were driven; ``then`` is called after each with how many times that was."""
        end_s, times = time.monotonic() + DEADLINE_S, [0]

        def is_stopped() -> bool:
            assert time.monotonic() < end_s
            if times[0] == scans:
                return True
            self.drive()
            times[0] += 1
            then(times[0])
            return False

        _run(self, is_stopped)  # type: ignore[arg-type]  # it stands in for the node


def events(out: Path) -> list[dict[str, Any]]:
    return [json.loads(line) for line in (out / "events.jsonl").read_text().splitlines()]


def test_a_node_leaves_its_map_its_record_and_what_it_took(tmp_path: Path) -> None:
    found: list[Any] = []
    node = Node(tmp_path / "r1", mode="mapper", seed=4)
    node.run(25, lambda times: found.extend([*local_robots(), AgentRecord.read(tmp_path / "r1")] if times == 3 else []))
    robot, during = found
    assert (robot.robot, robot.team, robot.endpoints) == ("r1", "depot", list(node.options.listen))
    after = AgentRecord.read(tmp_path / "r1")
    assert (during.ended, after.ended) == (False, True) and replace(after, ended=False) == during
    assert (after.id, after.team, after.mode, after.log) == ("r1", "depot", "mapper", None)
    assert after.settings["rbpf"]["particles"] == 3 and abs(after.begun_s - time.time()) < DEADLINE_S
    assert {"map.pgm", "map.yaml", "trajectory.tum", "robot.json", "checkpoint"} <= {
        path.name for path in (tmp_path / "r1").iterdir()
    }
    usage = read_usage(tmp_path / "r1")
    assert usage is not None and usage["cpu_s"] > 0.0 and usage["scan_age_ms"]["max"] >= 0.0
    assert node.said[-1] == "r1 of team depot is up" and not node.warned and local_robots() == []
    assert node.body.located is not None and node.body.on_ready.__name__ == "wake"


def test_a_node_that_starts_again_resumes_and_keeps_its_begin_unless_it_is_to_be_fresh(tmp_path: Path) -> None:
    out = tmp_path / "r1"
    Node(out).run(20)
    first = AgentRecord.read(out)
    again = Node(out)
    again.run(1)
    assert "r1 resumes from its checkpoint" in again.said[0] and "20 scans" in again.said[0]
    (back,) = (event for event in events(out) if event["event"] == "restarted")
    assert back["checkpoint"] and AgentRecord.read(out).begun_s == first.begun_s
    fresh = Node(out, fresh=True)
    fresh.run(1)
    assert "r1 begins a new map" in fresh.said[0] and (out / "checkpoint.old").exists()
    assert AgentRecord.read(out).begun_s > first.begun_s


def test_an_agent_that_a_service_puts_in_anothers_place_begins_at_once_without_a_past(tmp_path: Path) -> None:
    out = tmp_path / "r1"
    Node(out).run(5)
    node = Node(out)
    is_located: dict[int, bool] = {}

    def reset_at_the_tenth(times: int) -> None:
        if times == 10:
            node.sessions.reset()
        is_located[times] = node.body.located is not None

    node.run(20, reset_at_the_tenth)
    assert is_located[10] and not is_located[12] and is_located[20]  # the 11th scan comes between the two agents
    assert node.said.count("r1 of team depot is up") == 2
    assert len(list((out / "sessions").glob("*.session"))) == 1  # what ran before
    assert [event["event"] for event in events(out)].count("restarted") == 1
    mapped = json.loads((out / "robot.json").read_text())["scans"]
    assert 0 < mapped <= 10


@pytest.mark.parametrize("step_s", [3600, -3600])
def test_a_clock_that_was_set_before_a_reset_makes_no_scan_old(
    step_s: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    node, real_ns = Node(tmp_path), time.time_ns

    def set_and_reset(times: int) -> None:
        if times == 3:
            monkeypatch.setattr(time, "time_ns", lambda: real_ns() + step_s * 1_000_000_000)
            node.sessions.reset()

    node.run(10, set_and_reset)
    usage = read_usage(tmp_path)
    assert usage is not None and 0.0 < usage["scan_age_ms"]["max"] < 1e3 * DEADLINE_S


def test_the_folder_is_the_robots_own_and_nobody_elses_at_one_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    node, second = Node(""), Node(tmp_path / "out" / "r1")
    refused: list[str] = []

    def try_beside(times: int) -> None:
        if times == 2:
            with pytest.raises(InputError, match="another process writes there") as error:
                second.run(1)
            refused.append(str(error.value))

    node.run(3, try_beside)
    assert len(refused) == 1 and node.folder == Path("out/r1") and (tmp_path / "out" / "r1" / "robot.json").exists()


def test_keys_are_taken(tmp_path: Path) -> None:
    make_team_keys(tmp_path / "keys", "depot", ["r1"])
    found: list[Any] = []
    node = Node(tmp_path / "r1", listen=(f"tls/127.0.0.1:{free_port()}",), keys=str(tmp_path / "keys" / "r1"))
    node.run(2, lambda times: found.extend(local_robots()))
    assert found[0].is_secure
    with pytest.raises(InputError, match="r2"):
        Node(tmp_path / "r2", robot="r2", keys=str(tmp_path / "keys" / "r1")).run(1)


def test_options_are_those_of_the_agent(tmp_path: Path) -> None:
    node = Node(tmp_path, mode="central", seed=7)
    agent = _make_agent(node)  # type: ignore[arg-type]
    assert (agent.robot_id, agent.node.team, agent.mode) == ("r1", "depot", "central")
    assert agent.settings is SETTINGS and node.said == []
    assert agent.mapper.seed == 7
    assert abs(agent.node.boot_id - time.time() * 1e3) < DEADLINE_S * 1e3  # a restart has a higher one
    with pytest.raises(InputError, match="near is a place of one saved map"):
        _make_agent(Node(tmp_path, near="1,2"))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="nowhere"):
        _make_agent(Node(tmp_path, maps=(str(tmp_path / "nowhere.mrslam"),)))  # type: ignore[arg-type]


def test_a_merge_and_its_end_are_said_and_nothing_else() -> None:
    said: list[str] = []
    agent = Agent("r1", SETTINGS, team="depot", seed=0, boot_id=1)
    messages = MergeMessages(said.append)
    for kind, fields in (
        ("merged", {"a": "r1", "b": "r2"}),
        ("alignment", {"a": "r1", "b": "r2"}),
        ("unmerged", {"a": "r1", "b": "r2", "reason": "walls contradict"}),
    ):
        messages.on_event(agent, Event(0, kind, fields))
    assert said == ["merged the maps of r1 and r2", "parted the maps of r1 and r2: walls contradict"]
