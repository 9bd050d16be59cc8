"""The mission as a whole, from what its robots noted and its pairs are judged to be."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.judges import References, pair_judge
from mrslam.sim_driver.evaluate.mission_row import mission_row
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.spatial.files.tum import write_tum

TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual"},
    "world": {"name": "arena1"},
    "robots": [{"id": "r1"}, {"id": "r2"}],
}


def merged(t: float, x_m: float) -> dict[str, Any]:
    return {"t": t, "event": "merged", "a": "r1", "b": "r2", "T_a_b": [x_m, 0.0, 0.0], "confidence": 0.9}


def pair(overlap: float | None, error_m: float | None, error_deg: float, verdict: str = "") -> dict[str, Any]:
    return {"true_overlap": overlap, "error_m": error_m, "error_deg": error_deg, "verdict": verdict}


def row_of(
    tmp_path: Path,
    noted: list[dict[str, Any]],
    pairs: list[dict[str, Any]],
    begun_s: float | None = None,
    references: References | None = None,
) -> dict[str, Any]:
    """Return the row of a mission in which r2 sets out 2 m ahead of r1, and r1 noted this.

    ``begun_s`` : when both began the maps they have in the end, where they began them again.
    """
    (tmp_path / "r1").mkdir()
    (tmp_path / "r1" / "events.jsonl").write_text("".join(json.dumps({"robot": "r1", **e}) + "\n" for e in noted))
    run = RunResults.of(make_mission(TABLES, tmp_path / "m.toml"), tmp_path)
    for robot, x_m in (("r1", 0.0), ("r2", 2.0)):
        write_tum(tmp_path / robot / "truth.tum", np.array([0]), np.array([[x_m, 0.0, 0.0]]))
        if begun_s is not None:
            write_tum(tmp_path / robot / "trajectory.tum", np.array([round(begun_s * 1e9)]), np.zeros((1, 3)))
            run.robots[robot] = {}
    run.metrics.update({"mission_s": 60.0, "links": []})
    return mission_row(run, pair_judge(run, references or References()), {}, pairs)


def test_a_wrong_merge_on_the_way_counts_though_it_was_put_right(tmp_path: Path) -> None:
    back = {"t": 12.0, "event": "unmerged", "a": "r1", "b": "r2", "reason": "contradicted"}
    row = row_of(tmp_path, [merged(8.0, 3.0), back, merged(20.0, 2.1)], [])
    assert (row["first_merge_s"], row["first_correct_merge_s"], row["wrong_merges_on_the_way"]) == (8.0, 20.0, 1)


def test_a_merge_of_maps_that_were_given_up_is_neither_right_nor_wrong(tmp_path: Path) -> None:
    row = row_of(tmp_path, [merged(8.0, 2.0), merged(9.0, 5.0), merged(20.0, 2.0)], [], begun_s=15.0)
    assert (row["first_merge_s"], row["first_correct_merge_s"], row["wrong_merges_on_the_way"]) == (8.0, 20.0, 0)


def test_a_place_in_a_saved_map_is_no_merge_of_two_robots(tmp_path: Path) -> None:
    (tmp_path / "some.relations").write_text("0 1 2 0 0 0 0 0\n")
    placed = {**merged(5.0, 9.0), "a": "office@monday"}
    row = row_of(tmp_path, [placed, merged(8.0, 2.0)], [], references=References(tmp_path / "some.relations"))
    assert (row["first_merge_s"], row["first_correct_merge_s"], row["wrong_merges_on_the_way"]) == (8.0, 8.0, 0)


def test_pairs_are_counted_by_their_verdicts(tmp_path: Path) -> None:
    verdicts = {
        "correct merge": 0.5, "merged by one only": 0.5, "missed merge": 0.4, "never met": 0.0, "not merged": 0.1,
        "never met, though the maps overlap": 0.9, "merged, not judged": None,
    }  # fmt: skip
    pairs = [pair(overlap, None, 0.0, verdict) for verdict, overlap in verdicts.items()]
    pairs += [pair(overlap, 3.0, 0.0, "false merge") for overlap in (0.0, 0.1, 0.5, None)]
    row = row_of(tmp_path, [], pairs)
    kinds = ("correct_merges", "one_sided_merges", "missed_merges", "false_merges", "false_merges_without_overlap")
    assert [row[kind] for kind in kinds] == [1, 1, 2, 4, 3]


def test_alignments_are_counted_by_overlap_and_by_how_accurate_they_are(tmp_path: Path) -> None:
    pairs = [
        pair(0.1, 0.1, 0.5),
        pair(0.2, 0.1, 2.0),  # fine in one of the two alone
        pair(0.2, 0.4, 0.5),
        pair(0.2, 0.4, 9.0),
        pair(0.2, None, 0.0),
        pair(1.0, 0.0, 0.0),
        pair(None, 0.0, 0.0),
    ]
    rows = row_of(tmp_path, [], pairs)["success_by_overlap"]
    assert [row["pairs"] for row in rows] == [1, 4, 0, 1]
    assert [row["within_0.5m_5deg"] for row in rows] == [1, 2, 0, 1]
    assert [row["within_0.15m_1deg"] for row in rows] == [1, 0, 0, 1]
