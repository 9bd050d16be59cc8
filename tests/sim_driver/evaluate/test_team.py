"""The figures of a simulated mission as a whole: merges that are false, missed, or of one side alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.team import team_figures
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.spatial import OccupancyGrid, write_map
from mrslam.spatial.files.tum import write_tum

TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual"},
    "world": {"name": "arena1"},
    "robots": [{"id": "r1"}, {"id": "r2"}, {"id": "r3"}],
}


def pair(a: str, b: str, error_m: float | None, both_at_s: float | None, status: str = "accepted") -> dict[str, Any]:
    is_false = None if error_m is None else error_m > 0.5
    return {"a": a, "b": b, "status": status, "is_false": is_false, "both_at_s": both_at_s}


@pytest.mark.parametrize(("r3_m", "missed"), [(2.0, 1), (4.7, 0)])  # of its 4 m by 4 m r2's map shows 75 %, and 8 %
def test_merges_are_counted_that_are_false_missed_or_of_one_side(tmp_path: Path, r3_m: float, missed: int) -> None:
    run = RunResults.of(make_mission(TABLES, tmp_path / "m.toml"), tmp_path)
    for robot, x_m in (("r1", 0.0), ("r2", 1.0), ("r3", r3_m)):
        for name in ("map.yaml", "team_map.yaml"):
            write_map(tmp_path / robot / name, OccupancyGrid(np.zeros((40, 40), dtype=np.int8), 0.1))
        write_tum(tmp_path / robot / "trajectory.tum", np.array([0]), np.zeros((1, 3)))
        write_tum(tmp_path / robot / "truth.tum", np.array([0]), np.array([[x_m, 0.0, 0.0]]))
        run.robots[robot] = {"mode": "distributed", "pairs": []}
    pairs = [pair("r1", "r2", 0.1, None), pair("r1", "r3", 3.0, 12.0), pair("r2", "r3", None, None, "rejected")]
    figures = team_figures(run, pairs)
    assert figures is not None and not run.damage
    assert (figures["false_merges"], figures["one_sided_merges"], figures["missed_merges"]) == (1, 1, missed)
    assert set(figures["coverage_by_robot"]) == {"r1", "r2", "r3"} and figures["first_merge_s"] is None
