"""``mrslam report``: the page of a run, made again."""

from __future__ import annotations

from pathlib import Path

from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.report import write_report


def report_run(run: Path, out: Path | None) -> None:
    """Write the run's page and say where it is."""
    path = write_report(run, out)
    say(f"{path}: {path.stat().st_size / 1e3:.0f} kB; open it in any browser")
