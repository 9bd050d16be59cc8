"""Robots of one mission in several processes: the bytes of one process, and what fails in one fails here."""

from __future__ import annotations

import os
from dataclasses import replace
from multiprocessing import Pipe
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.agent import VirtualRobot
from mrslam.comms import MemoryNetwork, Send
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.robots import LASERS, Fleet, SimulatedRobot
from mrslam.sim_driver.run.run_shares import processes_for, run_in_shares
from mrslam.sim_driver.run.run_virtual import VirtualTeam
from mrslam.sim_driver.run.shares import AwayRobot, Hub, Turn
from mrslam.sim_driver.view import ViewOptions
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import InputError

TABLES: dict[str, Any] = {
    "mission": {"seed": 2, "duration_s": 25.0, "shell": "virtual"},
    "world": {"name": "arena2"},
    "robots": [{"id": f"r{k}", "laser": "lidar-360"} for k in (1, 2, 3)],
    "rbpf": {"particles": 3},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


def mission(robots: int = 3, **tables: Any) -> Mission:
    ids = [{"id": f"r{k + 1}", "laser": "lidar-360"} for k in range(robots)]
    return make_mission({**TABLES, "robots": ids, **tables}, Path("small.toml"))


def run(folder: Path, processes: int, steps: int = 0) -> tuple[dict[str, Any], dict[str, bytes]]:
    """Run the mission, or its first so many steps; return the outcome and all files."""
    asked: list[int] = []

    def stop() -> bool:
        asked.append(1)
        return len(asked) == steps

    outcome = run_in_shares(mission(), folder, lambda now_s, total_s, words: None, stop, processes)
    return outcome, {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


def test_robots_in_two_processes_leave_the_bytes_of_one(tmp_path: Path) -> None:
    (outcome, one), (other, two) = run(tmp_path / "one", 1), run(tmp_path / "two", 2)
    assert outcome == other
    events = b"".join(content for name, content in one.items() if name.endswith("events.jsonl"))
    assert b'"event": "merged"' in events and b'"exchange_done"' in events  # they met, also those of two processes
    assert one.keys() == two.keys()
    assert [name for name in one if one[name] != two[name]] == []


def test_a_mission_that_is_ended_early_ends_in_the_same_step_in_all_processes(tmp_path: Path) -> None:
    (outcome, one), (other, two) = run(tmp_path / "one", 1, steps=12), run(tmp_path / "three", 3, steps=12)
    assert outcome == other and outcome["interrupted"]
    assert one == two


def test_what_another_process_fails_at_is_raised(tmp_path: Path) -> None:
    robots = [{"id": "r1", "laser": "lidar-360"}, {"id": "r2", "log": "nowhere.clf"}]
    lacking = make_mission({**TABLES, "robots": robots}, tmp_path / "small.toml")
    with pytest.raises(InputError, match=r"nowhere\.clf"):
        run_in_shares(lacking, tmp_path / "out", lambda now_s, total_s, words: None, processes=2)


def test_a_hub_raises_what_it_is_sent() -> None:
    here, there = Pipe()
    there.send(InputError("no laser"))
    with pytest.raises(InputError, match="no laser"):
        Hub([here], lambda: False).meet({})


def test_a_hub_says_that_another_process_died() -> None:
    here, there = Pipe()
    there.close()
    with pytest.raises(RuntimeError, match="has died"):
        Hub([here], lambda: False).meet({})


def test_a_robot_of_another_process_sends_what_it_sent_there_and_keeps_nothing_that_came() -> None:
    network = MemoryNetwork()
    away, here = AwayRobot("r1", network.attach("r1"), None), network.attach("r2")
    here.send(Send("r1", b"for r1", "control"))
    away.take(Turn("r1", [Send("r2", b"for r2", "control")], None, finished=True))
    away.flush(0)
    network.advance(10**9)
    away.step(10**9, None)  # type: ignore[arg-type]
    assert [getattr(item, "payload", None) for item in here.poll()][-1] == b"for r2"
    assert away._transport.poll(0.0) == [] and away.finished


def test_processes_follow_cores_and_robots(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(8)))
    assert [processes_for(mission(robots)) for robots in (1, 4, 7, 8, 16, 64)] == [1, 1, 1, 2, 4, 8]
    assert processes_for(mission(3), asked=2) == 2 and processes_for(mission(3), asked=9) == 3


def test_missions_with_faults_or_a_view_are_played_in_one_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(os, "sched_getaffinity", lambda pid: set(range(8)))
    faulty = replace(mission(8), faults=(FaultConfig(robot="r1", kind="crash", at_s=3.0),))
    viewed = replace(mission(8), view=ViewOptions(record=True))
    assert processes_for(mission(8)) == 2
    assert processes_for(faulty) == processes_for(faulty, asked=2) == processes_for(viewed, asked=2) == 1


def test_lasers_of_robots_that_others_play_are_not_simulated() -> None:
    world = load_world("arena2")
    starts = [world.free_start(np.random.default_rng(k)) for k in range(2)]
    laser = LASERS["lidar-360"]

    def fleet() -> Fleet:
        return Fleet({f"r{k}": SimulatedRobot(world, starts[k], laser, np.random.default_rng(k)) for k in range(2)})

    (all_of_r1,) = [seen for seen in fleet().observe(0) if seen.robot_id == "r1"]
    (alone,) = fleet().observe(0, {"r1"})
    assert alone.robot_id == "r1" and np.array_equal(alone.scan.ranges_m, all_of_r1.scan.ranges_m, equal_nan=True)


def test_robots_of_one_process_share_matches_of_keyframes(tmp_path: Path) -> None:
    one, two, three = VirtualTeam(mission(), tmp_path, ["r1", "r2"]).robots
    assert isinstance(one, VirtualRobot) and isinstance(two, VirtualRobot) and isinstance(three, AwayRobot)
    assert one.runner._matcher._answers is two.runner._matcher._answers
