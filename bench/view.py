"""What watching costs a robot's scan thread: CPU of the thread that maps, with and without the view's share of it.

python -P bench/view.py [seconds of mission]
"""

from __future__ import annotations

import dataclasses
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

from agent import Runner
from sim_driver.mission import make_mission
from sim_driver.run import run_mission
from sim_driver.view import ViewOptions
from sim_driver.view.watch import ViewWatcher

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
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else 60.0
    tables = {**TABLES, "mission": {"seed": 1, "duration_s": seconds, "shell": "virtual"}}
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
