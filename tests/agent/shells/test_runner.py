"""What both shells do for a robot: carry its messages, report what happens, and save it."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, Event, Inline, Keeper, Runner, Sensed, Settings, VirtualRobot, checkpoint
from mrslam.agent.effects import JoinJob
from mrslam.comms import CommsConfig, MemoryNetwork
from mrslam.merge import JointMap
from mrslam.spatial import se2
from tests.full_disk import full_disk
from tests.merge.joint.blocks import drive

S = 1_000_000_000
SETTINGS = Settings(comms=CommsConfig(link_source="model", exchange_timeout_s=1.0))


class Quiet:
    """A laser that sees nothing."""

    next_ns, finished = None, False

    def sense(self, now_ns: int) -> None:
        return None

    def act(self, agent: Agent, now_ns: int) -> None:
        """Nothing to drive."""


class Links:
    """A radio model by which the robots hear each other."""

    def qualities(self, now_ns: int) -> dict[str, float]:
        return {"r1": 1.0, "r2": 1.0}


def test_robots_meet_by_the_radio_model_and_see_who_is_gone(tmp_path: Path) -> None:
    network, now_ns = MemoryNetwork(), 0
    robots = {
        name: Runner(Agent(name, SETTINGS), Quiet(), network.attach(name), tmp_path / name, Links())
        for name in ("r1", "r2")
    }

    def live(until_ns: int, *names: str) -> None:
        nonlocal now_ns
        while now_ns < until_ns:
            now_ns += S // 10
            network.advance(now_ns)
            for name in names:
                robots[name].receive(0.0, lambda at_ns=now_ns: at_ns)
                robots[name].tick(now_ns)

    def told(kind: str) -> list[dict[str, object]]:
        lines = (tmp_path / "r1" / "events.jsonl").read_text().splitlines()
        return [event for event in map(json.loads, lines) if event["event"] == kind]

    live(5 * S, "r1", "r2")
    assert told("exchange_done")
    network.crash("r2")
    live(now_ns + 5 * S, "r1")
    (gone,) = told("peer_gone")
    assert "its process or its link is gone" in str(gone["reason"])  # said by the network, not by silence


def test_a_robot_in_virtual_time_saves_itself(tmp_path: Path) -> None:
    keeper = Keeper(tmp_path / "state", 1.0, Inline())
    agent = Agent("r1", SETTINGS)
    robot = VirtualRobot(Runner(agent, Quiet(), MemoryNetwork().attach("r1"), tmp_path / "out", keeper=keeper))
    with ThreadPoolExecutor(1) as worker:
        for k in range(4):
            robot.step(k * S, worker)
    assert keeper.saved_ns is not None and keeper.path.exists()


class Onlooker:
    """Looks on, and fails at the end where it is given words to fail with."""

    def __init__(self, failure: str = "") -> None:
        self.failure, self.closed = failure, False

    def on_scan(self, agent: Agent, sensed: Sensed, now_ns: int) -> None:
        """Nothing to note."""

    def on_event(self, agent: Agent, event: Event) -> None:
        """Nothing to note."""

    def close(self, agent: Agent, now_ns: int) -> None:
        self.closed = True
        if self.failure:
            raise RuntimeError(self.failure)


def test_whatever_fails_at_the_end_state_and_files_are_written_and_the_failures_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    def stuck() -> None:
        raise RuntimeError("the network")

    agent, end, keeper = Agent("r1", SETTINGS), MemoryNetwork().attach("r1"), Keeper(tmp_path / "state", 1e9, Inline())
    monkeypatch.setattr(end, "close", stuck)
    watchers = [Onlooker("the recorder"), Onlooker()]
    runner = Runner(agent, Quiet(), end, tmp_path, watchers=watchers, keeper=keeper)
    with pytest.raises(RuntimeError, match="the network"):
        runner.close(0)
    assert "the recorder" in caplog.text
    assert watchers[1].closed and {"state", "robot.json", "map.yaml"} <= {path.name for path in tmp_path.iterdir()}


def test_what_could_not_be_written_is_counted_in_the_robots_file_and_a_lost_last_state_is_logged(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(checkpoint, "write", full_disk)
    keeper = Keeper(tmp_path / "state", 1e9, Inline())
    runner = Runner(Agent("r1", SETTINGS), Quiet(), MemoryNetwork().attach("r1"), tmp_path, keeper=keeper)
    runner.events.lost = 2
    runner.close(0)
    assert json.loads((tmp_path / "robot.json").read_text())["unwritten"] == {"events": 2, "checkpoints": 1}
    assert "state: the robot's state cannot be saved ([Errno 28] No space left on device)" in caplog.text


def test_a_joint_solution_is_told_where_robots_saw_each_other(tmp_path: Path) -> None:
    a, b = drive(0.0, 40.0, 0.0, seed=1), drive(10.0, 40.0, 0.0, seed=2)
    T_a_b = se2.between(a.truth[0], b.truth[0])
    elsewhere = se2.compose(np.array([3.0, 0.0, 0.0]), T_a_b)
    places = {"a": se2.IDENTITY, "b": T_a_b}
    runner = Runner(Agent("a", SETTINGS), Quiet(), MemoryNetwork().attach("a"), tmp_path, Links())
    for seen_there, tied in ((T_a_b, True), (elsewhere, False)):
        job = JoinJob(
            frame="a", trails={"a": a.trail, "b": b.trail}, T_team_map=places, T_a_b={("a", "b"): T_a_b},
            seen={("a", "b"): seen_there}, epochs={"a": 1, "b": 1},
        )  # fmt: skip
        joint = runner.work(job)
        assert isinstance(joint, JointMap) and bool(joint.ties) == tied
