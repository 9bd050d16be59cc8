"""The one map of a team, judged by the trajectories of all of its robots."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.evaluate import References
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.team_trajectories import team_row
from mrslam.spatial import se2
from mrslam.spatial.files.tum import write_tum

STAMPS = np.arange(50) * 100_000_000
WAYS = {
    "r1": np.stack([np.linspace(0.0, 20.0, 50), np.zeros(50), np.zeros(50)], axis=1),
    "r2": np.stack([np.linspace(20.0, 0.0, 50), np.full(50, 5.0), np.full(50, np.pi)], axis=1),
}
"""True poses in the world."""
T_VIEW_WORLD = se2.transform(3.0, -1.0, 0.7)


class Run(SimpleNamespace):
    """What is asked of a run's results: two robots, the way they lie in one's team frame, and the truth."""

    def __init__(self, ways: dict[str, Any], logs: tuple[str | None, ...] = (None, None), *, has_truth: bool = True):
        robots = [SimpleNamespace(id=name, log=log) for name, log in zip(("r1", "r2"), logs, strict=True)]
        super().__init__(ways=ways, mission=SimpleNamespace(robots=robots), has_truth=has_truth)

    def team_trajectories(self, robot_id: str) -> dict[str, Any]:
        return self.ways

    def laser_truth(self, robot_id: str) -> Any:
        return (STAMPS, WAYS[robot_id]) if self.has_truth else None


def in_view(**shift_m: float) -> dict[str, Any]:
    """Return the ways in the team frame, some shifted along the world's x."""
    moved = {name: way + np.array([shift_m.get(name, 0.0), 0.0, 0.0]) for name, way in WAYS.items()}
    return {name: (STAMPS, se2.compose(T_VIEW_WORLD, way)) for name, way in moved.items()}


def test_all_ways_are_laid_on_the_truth_together() -> None:
    row = team_row(Run(in_view()), References(), None, "r1")
    assert row == {"robots": ["r1", "r2"], "ate_rmse_m": pytest.approx(0.0), "ate_mean_deg": pytest.approx(0.0)}
    # 0.4 m apart: the best fit leaves half of it to each, and turns a little
    row = team_row(Run(in_view(r2=0.4)), References(), None, "r1")
    assert row["ate_rmse_m"] == pytest.approx(0.19, abs=0.01) and row["ate_mean_deg"] < 1.0


def test_relations_between_the_robots_are_judged_where_they_lie() -> None:
    t1, t2 = STAMPS[:20] // 1000, STAMPS[30:] // 1000 + 10**9
    relations = (t1, t2, se2.between(WAYS["r1"][:20], WAYS["r2"][30:]))
    ways = in_view(r2=0.4)
    ways["r2"] = (ways["r2"][0] + 10**12, ways["r2"][1])  # drove later
    row = team_row(Run(ways, ("one.log", "one.log"), has_truth=False), References(), relations, "r1")
    assert row == {"robots": ["r1", "r2"], "mean_m": pytest.approx(0.4), "mean_deg": pytest.approx(0.0), "count": 20}
    assert "mean_m" not in team_row(Run(ways, ("one.log", "other.log"), has_truth=False), References(), relations, "r1")


def test_who_is_alone_has_no_team() -> None:
    assert team_row(Run({"r1": (STAMPS, WAYS["r1"])}), References(), None, "r1") is None


def test_a_run_has_the_corrected_ways_where_there_are_some(tmp_path) -> None:
    robots = {name: {"placed": {"r1": [0.0, 0.0, 0.0], "r2": [1.0, 2.0, 0.0]}} for name in ("r1", "r2")}
    for name in robots:
        (tmp_path / name).mkdir()
        write_tum(tmp_path / name / "trajectory.tum", STAMPS, WAYS[name])
    (tmp_path / "r1" / "team").mkdir()
    write_tum(tmp_path / "r1" / "team" / "r1.tum", STAMPS, WAYS["r1"] + np.array([0.0, 0.3, 0.0]))
    mission = SimpleNamespace(robots=[SimpleNamespace(id=name) for name in robots])
    run = RunResults(tmp_path, mission, {}, robots)  # type: ignore[arg-type]
    ways = run.team_trajectories("r1")
    assert ways["r1"][1] == pytest.approx(WAYS["r1"] + np.array([0.0, 0.3, 0.0]), abs=1e-6)
    assert ways["r2"][1] == pytest.approx(WAYS["r2"] + np.array([1.0, 2.0, 0.0]), abs=1e-6)
    assert run.team_trajectories("r2")["r1"][1] == pytest.approx(WAYS["r1"], abs=1e-6)
