"""``mrslam demo``: robots explore a building, meet and merge; the shortest way to see what this is."""

from __future__ import annotations

import time
from pathlib import Path

from mrslam.sim_driver import missions
from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.runs.run import end_as_interrupted, report, run_with_progress
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.settings import read_toml

MISSION = Path(missions.__file__).with_name("demo.toml")
"""The demo's mission; its robots come from the command line."""


def demo(out: Path, seed: int, robots: int, rrd: Path | None, view: bool) -> None:
    """Run the demo's mission with this number of robots."""
    tables = read_toml(MISSION)
    tables["mission"]["seed"] = seed
    tables["robots"] = [{"id": f"r{i + 1}"} for i in range(robots)]
    say(f"{robots} robots explore an office from unknown starts, each in a process of its own.")
    start = time.monotonic()
    metrics = run_with_progress(make_mission(tables, MISSION), out, rrd, view)
    report(metrics, out, time.monotonic() - start)
    end_as_interrupted(metrics)
