"""``mrslam sweep``: a mission under varied settings."""

from __future__ import annotations

import json
import os
import time
from dataclasses import asdict
from pathlib import Path

from mrslam.sim_driver.cli.console import say
from mrslam.sim_driver.cli.progress import progress_bar
from mrslam.sim_driver.kernels import ensure_compiled
from mrslam.sim_driver.sweep import make_plan, parse_knob, run_sweep
from mrslam.sim_driver.sweep.advice import advice, pareto, summarise
from mrslam.sim_driver.sweep.plots import draw_all
from mrslam.sim_driver.sweep.sweep import steps
from mrslam.sim_driver.sweep.table import write_table
from mrslam.sim_driver.sweep.workers import workers_at
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import write_text


def sweep(
    mission: Path,
    vary: list[str],
    seeds: int | None,
    out: Path,
    drive: str,
    workers: int | None,
    scheduler: str | None,
    assignments: list[str],
    as_json: bool,
) -> None:
    """Run the sweep, or what is left of it, and leave table, plots and a recommendation in ``out``."""
    plan = make_plan(mission, [parse_knob(text) for text in vary], seeds, drive, assignments)
    count = workers or len(os.sched_getaffinity(0))
    driven = "each seed's drive is recorded once and played again" if plan.recorded else "every run drives anew"
    say(f"{len(plan.points)} runs ({len(plan.seeds)} seeds); {driven}")
    if scheduler is None:
        ensure_compiled(say)
    start = time.monotonic()
    with progress_bar("sweep", steps(plan)) as advance, workers_at(scheduler, count) as where:
        rows = run_sweep(plan, out, where, advance, say)
    if not rows:
        raise InputError("no run of the sweep succeeded")
    written = write_table(rows, out)
    summaries = summarise(rows, plan.knobs)
    sentence = advice(summaries, plan.knobs)
    write_text(out / "advice.txt", sentence + "\n")
    try:
        written += draw_all(rows, summaries, plan.knobs, out)
    except InputError as error:
        say(f"no plots: {error}")
    if as_json:
        front = [asdict(one) for one in pareto(summaries)]
        print(json.dumps({"advice": sentence, "pareto": front, "rows": rows}, default=str))
        return
    names = ", ".join(path.name for path in written)
    say(f"{len(rows)} of {len(plan.points)} runs in {time.monotonic() - start:.0f} s: {names} in {out}")
    say(sentence)
