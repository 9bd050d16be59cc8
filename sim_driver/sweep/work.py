"""What a worker does, on this machine or another: record a drive, or run one point; values in, values out."""

from __future__ import annotations

import io
import time
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.missions.run_files import OF_DRIVE
from mrslam.sim_driver.missions.run_folder import read_metrics
from mrslam.sim_driver.missions.settings import with_overrides
from mrslam.sim_driver.replay.again import replay_mission
from mrslam.sim_driver.run.run import run_mission


@dataclass(frozen=True)
class Job:
    """One run, as it travels to a worker."""

    path: str
    """The mission file; a worker elsewhere needs the files that it names in the same place, or in its data folder."""
    tables: dict[str, Any]
    assignments: tuple[str, ...]
    seed: int


def record_drive(job: Job) -> bytes:
    """Run the mission as it is and return what playing it again needs, as a zip file."""
    with TemporaryDirectory(prefix="mrslam-sweep-") as folder:
        out = Path(folder) / "run"
        _run(_mission(job, ["mission.record=true"]), out)
        return _packed(out)


def run_point(job: Job, drive: bytes | None) -> dict[str, Any]:
    """Run one point, on a recorded drive where there is one, and return its row of the table."""
    start = time.process_time()
    with TemporaryDirectory(prefix="mrslam-sweep-") as folder:
        out = Path(folder) / "run"
        if drive is None:
            mission = _mission(job, job.assignments)
        else:
            recorded = Path(folder) / "recorded"
            with zipfile.ZipFile(io.BytesIO(drive)) as archive:
                archive.extractall(recorded)
            mission = replay_mission(recorded, job.assignments)
        _run(mission, out)
        row = outcome_row(assess(out), read_metrics(out))
    return {**row, "cpu_s": round(time.process_time() - start, 2)}


def _mission(job: Job, assignments: Sequence[str]) -> Mission:
    tables = with_overrides(job.tables, [*assignments, f"mission.seed={job.seed}"])
    return make_mission(tables, Path(job.path))


def _run(mission: Mission, out: Path) -> None:
    run_mission(mission, out, lambda mission_s, total_s, text: None, lambda text: None)


def _packed(out: Path) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_STORED) as archive:
        for path in sorted(out.rglob("*")):
            if path.name in OF_DRIVE:
                archive.write(path, path.relative_to(out))
    return buffer.getvalue()


def outcome_row(assessment: dict[str, Any], metrics: dict[str, Any]) -> dict[str, Any]:
    """Return what a sweep's table says of one run."""
    mission, pairs, robots = assessment["mission"], assessment["pairs"], assessment["robots"].values()
    accepted = [pair for pair in pairs if pair["status"] == "accepted" and pair["error_m"] is not None]
    ate = [robot["trajectory"]["ate_rmse_m"] for robot in robots if robot["trajectory"] is not None]
    traffic = mission["bytes"]
    return {
        "first_merge_s": mission["first_merge_s"],
        "first_correct_merge_s": mission["first_correct_merge_s"],
        "coverage_best": mission["coverage_best"],
        "coverage_worst": mission["coverage_worst"],
        "bytes_exchanged": traffic["exchanges"],
        "bytes_sent": sum(traffic.get(lane, 0) for lane in ("beacon", "control", "bulk")),
        "error_m": _mean([pair["error_m"] for pair in accepted]),
        "error_deg": _mean([pair["error_deg"] for pair in accepted]),
        "ate_m": _mean(ate),
        "correct_merges": mission["correct_merges"],
        "false_merges": mission["false_merges"],
        "wrong_on_the_way": mission["wrong_merges_on_the_way"],
        "missed_merges": mission["missed_merges"],
        "exchanges_done": mission["exchanges"]["done"] // 2,
        "exchanges_failed": mission["exchanges"]["failed"],
        "alignments_tried": mission["alignments_tried"],
        "mission_s": mission["mission_s"],
        "drive_holds_until_s": metrics.get("replay", {}).get("drive_holds_until_s"),
    }


def _mean(values: list[float]) -> float | None:
    return round(sum(values) / len(values), 4) if values else None
