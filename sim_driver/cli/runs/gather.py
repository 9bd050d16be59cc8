"""``mrslam gather``: agents' folders as one run."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence
from pathlib import Path

from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.runs.run import report
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.run.gather import gather


def gather_agents(folders: Sequence[Path], out: Path, as_json: bool) -> None:
    """Put the folders together, write the page, and print the outcome."""
    start = time.monotonic()
    mission, metrics = gather(folders, out, say)
    if len(metrics["robots_lost"]) < len(mission.robots):
        write_report(out)
    if as_json:
        print(json.dumps(metrics))
    else:
        report(metrics, out, time.monotonic() - start)
