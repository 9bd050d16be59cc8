"""``mrslam sweep``: a mission under varied settings."""

from __future__ import annotations

import json
import os
import time
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.sim_driver.sweep import make_plan, parse_knob, run_sweep
from mrslam.sim_driver.sweep.advice import advice, pareto, summarise
from mrslam.sim_driver.sweep.plan import Plan
from mrslam.sim_driver.sweep.plots import draw_all
from mrslam.sim_driver.sweep.sweep import point_file, steps
from mrslam.sim_driver.sweep.table import write_table
from mrslam.sim_driver.sweep.workers import workers_at
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import write_text


@dataclass(frozen=True, kw_only=True)
class SweepOptions:
    """What the command line says; what it does not say is None or empty."""

    mission: Path
    vary: list[str]
    seeds: int | None
    out: Path
    drive: str
    workers: int | None
    scheduler: str | None
    assignments: list[str]
    as_json: bool


def sweep(options: SweepOptions) -> None:
    """Run the sweep, or what is left of it, and leave table, plots and a recommendation in the folder."""
    start = time.monotonic()
    knobs = [parse_knob(text) for text in options.vary]
    plan = make_plan(options.mission, knobs, options.seeds, options.drive, options.assignments)
    mission = make_mission(plan.tables, plan.path)
    if mission.world is not None:
        make_world(mission)  # what no run could begin with is said once, and now
    rows = _rows(plan, options)
    written = write_table(rows, options.out)
    summaries = summarise(rows, plan.knobs)
    sentence = advice(summaries, plan.knobs)
    write_text(options.out / "advice.txt", sentence + "\n")
    try:
        written += draw_all(rows, summaries, plan.knobs, options.out)
    except InputError as error:
        say(f"no plots: {error}")
    if options.as_json:
        front = [asdict(one) for one in pareto(summaries)]
        print(json.dumps({"advice": sentence, "pareto": front, "rows": rows}, default=str))
        return
    names = ", ".join(path.name for path in written)
    say(f"{len(rows)} of {len(plan.points)} runs in {time.monotonic() - start:.0f} s: {names} in {options.out}")
    say(sentence)


def _rows(plan: Plan, options: SweepOptions) -> list[dict[str, Any]]:
    """Run all points and return a row for each that succeeded."""
    driven = "each seed's drive is recorded once and replayed" if plan.recorded else "every run drives anew"
    say(f"{len(plan.points)} runs ({len(plan.seeds)} seeds); {driven}")
    if options.scheduler is None:
        ensure_compiled(say)
    count = options.workers or len(os.sched_getaffinity(0))
    try:
        with progress_bar("sweep", steps(plan)) as advance, workers_at(options.scheduler, count) as workers:
            rows = run_sweep(plan, options.out, workers, advance, say)
    except KeyboardInterrupt:
        done = sum(point_file(options.out, point).exists() for point in plan.points)
        say(f"{done} of {len(plan.points)} runs are done; the same command does the rest")
        raise
    if not rows:
        raise InputError("no run of the sweep succeeded")
    return rows
