"""A mission in virtual time that is interrupted keeps what it has by then."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.cli.signals import interrupts_noted
from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.run.run import run_mission

TABLES: dict[str, Any] = {
    "mission": {"seed": 2, "duration_s": 20.0, "shell": "virtual"},
    "world": {"name": "arena2"},
    "robots": [{"id": "r1"}, {"id": "r2"}],
    "rbpf": {"particles": 3},
    "agent": {"tick_s": 0.1},
}
CODE = """
import os, signal, sys
from mrslam.sim_driver.simulation.simulation import Simulation
advance, left = Simulation.advance, [15]
def interrupted(self, now_ns):
    left[0] -= 1
    if left[0] == 0: os.kill(os.getpid(), signal.SIGINT)
    advance(self, now_ns)
Simulation.advance = interrupted
from mrslam.sim_driver.cli import main; main()
"""
MISSION = """
mission = {shell = "virtual", duration_s = 20.0}
world = {name = "arena2"}
robots = [{id = "r1"}, {id = "r2"}]
rbpf = {particles = 3}
"""


def run(out: Path, steps: int | None = None, **mission: object) -> dict[str, Any]:
    """Run the mission, or its first so many steps."""
    asked: list[int] = []

    def stop() -> bool:
        asked.append(1)
        return len(asked) == steps

    tables = {**TABLES, "mission": {**TABLES["mission"], **mission}}
    one = make_mission(tables, Path("small.toml"))
    return run_mission(one, out, lambda mission_s, total_s, text: None, print, lambda: nullcontext(stop))


def test_it_leaves_what_a_mission_of_that_length_leaves(tmp_path: Path) -> None:
    metrics = run(tmp_path / "cut", steps=30)
    assert metrics["interrupted"] is True and metrics["mission_s"] == 2.9 and metrics["robots_lost"] == []
    assert "interrupted" not in run(tmp_path / "short", duration_s=3.0)
    names = [str(path.relative_to(tmp_path / "short")) for path in (tmp_path / "short").rglob("*") if path.is_file()]
    assert "r1/team_map.png" in names and "r2/scans.npz" in names
    for name in {*names} - {"metrics.json", "config.json"}:
        assert (tmp_path / "cut" / name).read_bytes() == (tmp_path / "short" / name).read_bytes(), name


def test_interrupted_at_once_it_is_still_a_run(tmp_path: Path) -> None:
    assert run(tmp_path, steps=1)["mission_s"] == 0.0
    assert set(assess(tmp_path)["robots"]) == {"r1", "r2"}
    assert write_report(tmp_path).exists()


def test_the_command_says_so_and_ends_as_ctrl_c_does(tmp_path: Path) -> None:
    (tmp_path / "small.toml").write_text(MISSION)
    command = [sys.executable, "-c", CODE, "run", "small.toml", "--out", "out"]
    said = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, timeout=300, check=False)
    assert said.returncode == 130, said.stderr
    assert "interrupted after 1 s of mission: these are the results so far" in said.stderr
    assert "Traceback" not in said.stderr
    out = tmp_path / "out"
    assert (out / "report.html").exists() and (out / "r2" / "map.pgm").exists()
    assert json.loads((out / "metrics.json").read_text())["interrupted"] is True
    told = subprocess.run([*command, "--json"], capture_output=True, text=True, cwd=tmp_path, timeout=300, check=False)
    assert told.returncode == 130 and json.loads(told.stdout)["interrupted"] is True


def test_ctrl_c_is_noted_once_and_raises_the_second_time() -> None:
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt), interrupts_noted() as interrupted:
        assert not interrupted()
        os.kill(os.getpid(), signal.SIGINT)
        assert interrupted()
        os.kill(os.getpid(), signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is before
