"""What watching costs a robot's scan thread: CPU of the thread that maps, with and without the view's share of it.

``python bench/view.py [--seconds 60]``
"""

from __future__ import annotations

import argparse
import dataclasses
import tempfile
import time
from pathlib import Path
from typing import Any

from mrslam.agent import Runner
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.view import ViewOptions
from mrslam.sim_driver.view.watch import ViewWatcher

TABLES = {"world": {"name": "office"}, "robots": [{"id": "r1"}, {"id": "r2"}]}


def clocked(function: Any, spent: list[float]) -> Any:
    def call(*args: Any) -> Any:
        start = time.thread_time()
        try:
            return function(*args)
        finally:
            spent[0] += time.thread_time() - start

    return call


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seconds", type=float, default=60.0, help="of mission")
    args = parser.parse_args()
    tables = {**TABLES, "mission": {"seed": 1, "duration_s": args.seconds, "shell": "virtual"}}
    viewing, scanning = [0.0], [0.0]
    for name in ("on_scan", "on_event"):
        setattr(ViewWatcher, name, clocked(getattr(ViewWatcher, name), viewing))
    Runner.sense = clocked(Runner.sense, scanning)  # type: ignore[method-assign]
    with tempfile.TemporaryDirectory() as folder:
        mission = make_mission({**tables, "rbpf": {"threads": 1}}, Path("bench.toml"))
        view = ViewOptions(record=True, robots=("r1", "r2"))
        run_mission(dataclasses.replace(mission, view=view), Path(folder), lambda *told: None, print)
    alone = scanning[0] - viewing[0]
    print(f"scan threads {alone:.2f} s of CPU; the view {viewing[0] * 1e3:.0f} ms more: {viewing[0] / alone:.2%}")


if __name__ == "__main__":
    main()
