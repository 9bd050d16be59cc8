"""Running a plan: finished points are kept as files, so that a sweep that was stopped can be resumed."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

from mrslam.sim_driver.sweep.plan import Plan, Point
from mrslam.sim_driver.sweep.work import Job, record_drive, run_point
from mrslam.sim_driver.sweep.workers import Workers
from mrslam.spatial import InputError
from mrslam.spatial.files.atomic import write_bytes, write_text

Say = Callable[[str], None]


def run_sweep(plan: Plan, out: Path, workers: Workers, advance: Callable[[], None], say: Say) -> list[dict[str, Any]]:
    """Run what is not there yet and return a row for every point that worked, in the plan's order.

    ``advance`` is called after every drive and every point, those found finished included.
    """
    rows: dict[str, dict[str, Any]] = {}
    waiting: dict[int, list[Point]] = {}
    for point in plan.points:
        row = _finished(point_file(out, point))
        if row is not None:
            rows[point.name] = row
            advance()
        else:
            waiting.setdefault(point.seed, []).append(point)
    pending: dict[Any, int | Point] = {}
    for seed in plan.seeds:
        points = waiting.get(seed, [])
        drive = drive_file(plan, out, seed)
        if not plan.recorded or not points:
            advance()
            pending |= {workers.submit(run_point, _job(plan, point), None): point for point in points}
        elif drive.exists():
            advance()
            pending |= _play(plan, points, workers, drive.read_bytes())
        else:
            pending[workers.submit(record_drive, Job(str(plan.path), plan.tables, (), seed))] = seed
    while pending:
        for future in workers.next_done(set(pending)):
            done = pending.pop(future)
            advance()
            try:
                result = future.result()
            except Exception as error:  # noqa: BLE001  one run's failure is one missing point, said aloud
                kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
                say(f"{_words(plan, done)} failed: {kind}{error}")
                continue
            if isinstance(done, int):
                write_bytes(drive_file(plan, out, done), result)
                pending |= _play(plan, waiting[done], workers, result)
            else:
                rows[done.name] = result
                write_text(point_file(out, done), json.dumps(result, allow_nan=False) + "\n")
    return [_labelled(plan, point, rows[point.name]) for point in plan.points if point.name in rows]


def steps(plan: Plan) -> int:
    """Return how often a whole sweep calls ``advance``."""
    return len(plan.points) + len(plan.seeds)


def point_file(out: Path, point: Point) -> Path:
    """Return where a finished point is kept."""
    return out / "points" / f"{point.name}.json"


def _finished(path: Path) -> dict[str, Any] | None:
    """Return the row of a finished point; None where there is none, or its file is damaged: then it is run again."""
    try:
        row = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return row if isinstance(row, dict) and "bytes_exchanged" in row else None


def drive_file(plan: Plan, out: Path, seed: int) -> Path:
    """Return where a recorded drive is kept."""
    return out / "drives" / f"seed-{seed}-{plan.drive_name(seed)}.zip"


def _play(plan: Plan, points: list[Point], workers: Workers, drive: bytes) -> dict[Any, int | Point]:
    shared = workers.share(drive)
    return {workers.submit(run_point, _job(plan, point), shared): point for point in points}


def _job(plan: Plan, point: Point) -> Job:
    return Job(str(plan.path), plan.tables, point.assignments, point.seed)


def _words(plan: Plan, done: int | Point) -> str:
    return f"the drive of seed {done}" if isinstance(done, int) else f"{', '.join(done.assignments)}, seed {done.seed}"


def _labelled(plan: Plan, point: Point, row: dict[str, Any]) -> dict[str, Any]:
    knobs = {knob.key: value for knob, value in zip(plan.knobs, point.settings, strict=True)}
    return {**knobs, "seed": point.seed, **{key: value for key, value in row.items() if key != "cpu_s"}}
