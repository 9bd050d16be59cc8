"""A robot whose process is killed comes back, and goes on where it was."""

from __future__ import annotations

import json
import multiprocessing as mp
import os
import signal
from pathlib import Path

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission

TABLES = {
    "mission": {"shell": "process", "speed": 3.0, "duration_s": 120.0, "seed": 3, "restart": True},
    "world": {"name": "arena2"},
    "robots": [{"id": "r1"}, {"id": "r2"}],
    "rbpf": {"particles": 5},
    "agent": {"checkpoint_interval_s": 1.0, "give_up_s": 1000.0},  # how far it drove unseen, a busy machine decides
    "comms": {"exchange_timeout_s": 5.0},
}


def test_a_killed_robot_comes_back_with_its_map(tmp_path: Path) -> None:
    killed: list[float] = []

    def progress(mission_s: float, total_s: float | None, text: str) -> None:
        if mission_s > 20.0 and not killed:
            victim = next(child for child in mp.active_children() if child.name == "mrslam-r1")
            assert victim.pid is not None
            os.kill(victim.pid, signal.SIGKILL)
            killed.append(mission_s)

    metrics = run_mission(make_mission(TABLES, tmp_path / "killed.toml"), tmp_path, progress, print)
    assert killed and metrics["restarts"] == {"r1": 1, "r2": 0}
    assert metrics["exit_codes"] == {"r1": 0, "r2": 0} and metrics["robots_lost"] == []
    events = [json.loads(line) for line in (tmp_path / "r1" / "events.jsonl").read_text().splitlines()]
    back = next(event for event in events if event["event"] == "restarted")
    assert back["checkpoint"] and back["scans"] > 100
    robot = json.loads((tmp_path / "r1" / "robot.json").read_text())
    assert robot["scans"] >= back["scans"]  # the trajectory holds both lives
    stamps = [
        float(line.split()[0])
        for line in (tmp_path / "r1" / "trajectory.tum").read_text().splitlines()
        if line[0] != "#"
    ]
    assert stamps[0] < 1.0 and len(stamps) > 100
    seen = [json.loads(line) for line in (tmp_path / "r2" / "events.jsonl").read_text().splitlines()]
    assert [event["event"] for event in seen if event["event"] in ("peer_gone", "peer_seen")].count("peer_seen") == 2
