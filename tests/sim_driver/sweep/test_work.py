"""What a sweep's table says of one run, and with which seed it ran."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.sweep import make_plan, parse_knob
from mrslam.sim_driver.sweep.work import Job, outcome_row, run_point

MISSION = {
    "first_merge_s": 5.0, "first_correct_merge_s": 9.0, "coverage_best": 0.8, "coverage_worst": 0.3,
    "correct_merges": 2, "false_merges": 1, "wrong_merges_on_the_way": 4, "missed_merges": 3, "alignments_tried": 17,
    "mission_s": 60.0, "bytes": {"exchanges": 900, "beacon": 30, "control": 200, "bulk": 1000, "other": 7},
    "exchanges": {"opened": 4, "done": 6, "failed": 1},
}  # fmt: skip


def pair(status: str, error_m: float | None, error_deg: float | None) -> dict[str, Any]:
    return {"status": status, "error_m": error_m, "error_deg": error_deg}


def test_a_row_holds_what_the_run_came_to() -> None:
    pairs = [
        pair("accepted", 0.1, 2.0),
        pair("accepted", 0.3, 1.0),
        pair("accepted", None, None),
        pair("revoked", 9.0, 9.0),
    ]
    robots = {"r1": {"trajectory": {"ate_rmse_m": 0.2}}, "r2": {"trajectory": None}}
    row = outcome_row({"mission": MISSION, "pairs": pairs, "robots": robots}, {"replay": {"drive_holds_until_s": 33.0}})
    assert row == {
        "first_merge_s": 5.0, "first_correct_merge_s": 9.0, "coverage_best": 0.8, "coverage_worst": 0.3,
        "bytes_exchanged": 900, "bytes_sent": 1230, "error_m": 0.2, "error_deg": 1.5, "ate_m": 0.2,
        "correct_merges": 2, "false_merges": 1, "wrong_on_the_way": 4, "missed_merges": 3, "exchanges_done": 3,
        "exchanges_failed": 1, "alignments_tried": 17, "mission_s": 60.0, "drive_holds_until_s": 33.0,
    }  # fmt: skip


def test_where_there_is_nothing_to_measure_there_is_no_value() -> None:
    row = outcome_row({"mission": MISSION | {"bytes": {"exchanges": 0}}, "pairs": [], "robots": {}}, {})
    assert (row["error_m"], row["error_deg"], row["ate_m"], row["drive_holds_until_s"]) == (None, None, None, None)
    assert row["bytes_sent"] == 0


@pytest.fixture
def path(tmp_path: Path) -> Path:
    """A mission of one robot that ends at once."""
    file = tmp_path / "one.toml"
    file.write_text(
        '[mission]\nduration_s = 2.0\n[world]\nname = "arena1"\n[[robots]]\nid = "r1"\n[rbpf]\nparticles = 3\n'
    )
    return file


def test_a_run_has_the_seed_and_the_settings_of_its_point(path: Path) -> None:
    plan = make_plan(path, [parse_knob("mission.duration_s=1,2")], 2, "anew")
    rows = {}
    for point in plan.points:
        rows[point.assignments[0], point.seed] = run_point(
            Job(str(path), plan.tables, point.assignments, point.seed), None
        )
    short, again = rows["mission.duration_s=1", 0], rows["mission.duration_s=1", 1]
    assert short["mission_s"] < rows["mission.duration_s=2", 0]["mission_s"]
    assert short["cpu_s"] >= 0.0 and again.keys() == short.keys()
    assert {**again, "cpu_s": 0.0} != {**short, "cpu_s": 0.0}
