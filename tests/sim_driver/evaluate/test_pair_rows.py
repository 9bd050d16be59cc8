"""What is said of a pair of robots in the end, by what each of them believes and by how far their maps overlap."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.evaluate.judges import References, pair_judge
from mrslam.sim_driver.evaluate.pair_rows import pair_row
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.spatial import OccupancyGrid, write_map
from mrslam.spatial.files.tum import write_tum

TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual"},
    "world": {"name": "arena1"},
    "robots": [{"id": "r1"}, {"id": "r2"}],
}
SIZES = {"bytes_sent": 1, "bytes_received": 1, "bytes_full_lz4": 2, "bytes_full_raw": 3}
SIDE_M = 4.0
"""Both maps are free squares of this edge, metres."""


def view(status: str, x_m: float | None = None, at_s: float | None = None, reason: str = "") -> dict[str, Any]:
    T_a_b = None if x_m is None else [x_m, 0.0, 0.0]
    return {"a": "r1", "b": "r2", "status": status, "T_a_b": T_a_b, "accepted_at_s": at_s, "reason": reason}


def row_of(
    folder: Path, apart_m: float | None, views: dict[str, dict[str, Any]], *, met: bool = False
) -> tuple[dict[str, Any], list[str]]:
    """Return the row of r1 and r2, whose maps lie this far apart (None: nobody knows), and what was not judged.

    ``met`` : whether r1 noted an exchange with r2.
    """
    (folder / "r1").mkdir()
    done = json.dumps({"t": 5.0, "robot": "r1", "event": "exchange_done", "peer": "r2", "reason": "", **SIZES})
    (folder / "r1" / "events.jsonl").write_text(done + "\n" if met else "")
    run = RunResults.of(make_mission(TABLES, folder / "m.toml"), folder)
    for robot, x_m in (("r1", 0.0), ("r2", apart_m)):
        write_map(folder / robot / "map.yaml", OccupancyGrid(np.zeros((40, 40), dtype=np.int8), SIDE_M / 40))
        write_tum(folder / robot / "trajectory.tum", np.array([0]), np.zeros((1, 3)))
        if apart_m is not None:
            write_tum(folder / robot / "truth.tum", np.array([0]), np.array([[x_m, 0.0, 0.0]]))
        mine = [views[robot]] if robot in views else []
        run.robots[robot] = {"mode": "distributed", "pairs": mine, "placed": {}}
    not_judged: list[str] = []
    row = pair_row(run, pair_judge(run, References()), "r1", "r2", not_judged)
    assert not run.damage
    return row, not_judged


@pytest.mark.parametrize(
    ("apart_m", "met", "verdict"),
    [
        (1.0, True, "missed merge"),
        (1.0, False, "never met, though the maps overlap"),
        (3.6, True, "not merged"),  # a tenth of each map is too little
        (3.6, False, "never met"),
        (None, True, "not merged"),
    ],
)
def test_of_two_that_are_not_merged_it_is_said_whether_they_met_and_whether_they_should_have(
    tmp_path: Path, apart_m: float | None, met: bool, verdict: str
) -> None:
    row, not_judged = row_of(tmp_path, apart_m, {}, met=met)
    assert (row["verdict"], row["status"]) == (verdict, "never met")
    whether = "r1-r2, whether it should have merged: the true overlap of the maps is not known"
    assert not_judged == ([whether] if apart_m is None else [])


def test_who_knows_the_others_map_has_met_it_though_no_alignment_was_tried(tmp_path: Path) -> None:
    row, _ = row_of(tmp_path, 1.0, {"r2": view("untried", reason="too small")})
    assert (row["verdict"], row["status"], row["reason"]) == ("missed merge", "rejected", "too small")


def test_a_merge_by_one_of_two_is_no_correct_merge_and_by_both_it_is(tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    (tmp_path / "both").mkdir()
    right, rejected = view("accepted", 1.0, 9.0), view("rejected", reason="ambiguous")
    row, not_judged = row_of(tmp_path / "one", 1.0, {"r1": rejected, "r2": right})
    assert (row["verdict"], row["accepted_by"], row["not_by"]) == ("merged by one only", ["r2"], {"r1": "ambiguous"})
    assert row["views"]["r1"]["status"] == "rejected" and not not_judged
    row, _ = row_of(tmp_path / "both", 1.0, {"r1": view("accepted", 1.1, 12.0), "r2": right})
    assert (row["verdict"], row["true_overlap"]) == ("correct merge", 0.75)
    assert (row["accepted_at_s"], row["both_at_s"], row["error_m"]) == (9.0, 12.0, 0.0)  # r2 was the first


def test_one_wrong_view_is_a_false_merge_and_one_that_nothing_judges_is_told(tmp_path: Path) -> None:
    (tmp_path / "wrong").mkdir()
    (tmp_path / "unknown").mkdir()
    row, _ = row_of(tmp_path / "wrong", 1.0, {"r1": view("accepted", 1.0, 9.0), "r2": view("accepted", 3.0, 12.0)})
    assert (row["verdict"], row["is_false"], row["views"]["r2"]["is_false"]) == ("false merge", False, True)
    views = {"r1": view("accepted", 1.0, 9.0), "r2": view("accepted", 1.0, 9.0)}
    row, not_judged = row_of(tmp_path / "unknown", None, views)
    assert row["verdict"] == "merged, not judged"
    assert not_judged == ["r1-r2, merge: no truth, reference, relation or true map links the two"]
