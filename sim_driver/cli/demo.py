"""``mrslam demo``: robots explore a building, meet and merge; the shortest way to see what this is."""

from __future__ import annotations

import time
from pathlib import Path

import sim_driver
from sim_driver.cli.console import say
from sim_driver.cli.run import end_as_interrupted, report, run_with_progress
from sim_driver.mission import make_mission
from sim_driver.settings import read_toml

MISSION = Path(sim_driver.__file__).parent / "demo.toml"


def demo(out: Path, seed: int, robots: int, rrd: Path | None, view: bool) -> None:
    """Run the demo's mission with so many robots."""
    tables = read_toml(MISSION)
    tables["mission"]["seed"] = seed
    tables["robots"] = [{"id": f"r{i + 1}"} for i in range(robots)]
    say(f"{robots} robots explore an office from unknown starts, each in a process of its own.")
    start = time.monotonic()
    metrics = run_with_progress(make_mission(tables, MISSION), out, rrd, view)
    report(metrics, out, time.monotonic() - start)
    end_as_interrupted(metrics)
