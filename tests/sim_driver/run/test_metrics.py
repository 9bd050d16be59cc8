"""What a run's metrics say of its pairs, by what the robots left."""

from __future__ import annotations

import json
import logging
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.evaluate.judges import Judgement
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.run_folder import read_metrics
from mrslam.sim_driver.run.metrics import NEVER_MET, _judged, write_metrics
from mrslam.spatial import se2
from tests.sim_driver.evaluate.test_judges import T_A_B, relations
from tests.sim_driver.evaluate.test_judges import run as recorded_run
from tests.sim_driver.runs import played

STARTS = ([2.0, 2.0, 0.0], [3.0, 2.5, 1.0])
TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual", "seed": 3, "duration_s": 4.0},
    "world": {"name": "arena1"},
    "robots": [{"id": f"r{k + 1}", "start": start} for k, start in enumerate(STARTS)],
    "rbpf": {"particles": 1, "threads": 1},
    "comms": {"exchange_timeout_s": 600.0},
}
UNKNOWN = {
    "a": "r1", "b": "r2", "T_a_b": None, "accepted_at_s": None, "confidence": None, "attempts": 1, "places": [],
}  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return played(TABLES, tmp_path_factory.mktemp("metrics") / "run")


def told(run: Path, out: Path, **pairs: dict[str, Any]) -> dict[str, Any]:
    """Return what the metrics say of the pair, where the robots believe this of it."""
    shutil.copytree(run, out)
    for robot_id in ("r1", "r2"):
        path = out / robot_id / "robot.json"
        robot = json.loads(path.read_text())
        robot["pairs"] = [{**UNKNOWN, **pairs[robot_id]}] if robot_id in pairs else []
        path.write_text(json.dumps(robot))
    (pair,) = write_metrics(make_mission(TABLES, Path("small.toml")), out, wall_s=1.0, mission_s=4.0)["pairs"]
    assert read_metrics(out)["pairs"] == [pair]
    return pair


def test_a_pair_that_nobody_knows_of_never_met(run: Path, tmp_path: Path) -> None:
    pair = told(run, tmp_path / "copy")
    assert (pair["status"], pair["reason"], pair["judged_by"]) == ("rejected", NEVER_MET, "not merged")


@pytest.mark.parametrize("status", ["revoked", "untried", "rejected"])
def test_a_pair_that_is_not_merged_is_rejected_with_its_reason(run: Path, tmp_path: Path, status: str) -> None:
    belief = {"status": status, "reason": "walls of r1 are on free space"}
    pair = told(run, tmp_path / "copy", r1=belief, r2=belief)
    assert (pair["status"], pair["reason"]) == ("rejected", belief["reason"])
    assert (pair["error_m"], pair["judged_by"]) == (None, "not merged")


def test_a_merge_by_one_of_two_is_judged_by_the_simulator(run: Path, tmp_path: Path) -> None:
    T_a_b = se2.compose(se2.between(*np.array(STARTS)), se2.transform(0.3, 0.4, 0.1))
    merge = {
        "status": "accepted",
        "T_a_b": T_a_b.tolist(),
        "confidence": 0.9,
        "accepted_at_s": 3.0,
        "reason": "accepted",
    }
    pair = told(run, tmp_path / "copy", r1={"status": "rejected", "reason": "too little wall"}, r2=merge)
    assert (pair["status"], pair["accepted_by"], pair["judged_by"]) == ("accepted", ["r2"], "simulated truth")
    assert pair["error_m"] == pytest.approx(0.5, abs=0.02) and pair["error_deg"] == pytest.approx(5.73, abs=0.1)


def test_robots_of_a_log_are_judged_by_its_relations_or_it_is_said_why_not() -> None:
    recorded, merge = recorded_run(("a", "a")), T_A_B.tolist()
    by_relations = _judged(recorded, "r1", "r2", merge, relations)
    assert by_relations == Judgement(pytest.approx(0.0), pytest.approx(0.0), "20 of 20 relations")
    first, second, T_first_second = relations()
    elsewhere = (first + 10**9, second + 10**9, T_first_second)  # of times at which neither was on its way
    assert _judged(recorded, "r1", "r2", merge, lambda: elsewhere) == "no relation links the two robots"
    assert _judged(recorded, "r1", "r2", merge, lambda: None) == "no truth"


def test_a_simulated_pair_is_judged_by_its_first_scans_and_by_its_whole_ways() -> None:
    places = {"r1": np.zeros(3), "r2": T_A_B}
    bent = {"r1": np.zeros(3), "r2": se2.compose(T_A_B, se2.transform(0.3, 0.0, 0.0))}
    run = recorded_run(T_world_map=places, T_world_way=bent)
    judged = _judged(run, "r1", "r2", T_A_B.tolist(), lambda: None)
    assert isinstance(judged, Judgement) and judged.judged_by == "simulated truth"
    assert (judged.error_m, judged.alignment_m) == (pytest.approx(0.0), pytest.approx(0.3))


def test_what_is_damaged_is_said(run: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    shutil.copytree(run, tmp_path / "copy")
    (tmp_path / "copy" / "r2" / "robot.json").write_text("{")
    with caplog.at_level(logging.WARNING):
        metrics = write_metrics(make_mission(TABLES, Path("small.toml")), tmp_path / "copy", wall_s=1.0, mission_s=4.0)
    assert [robot["id"] for robot in metrics["robots"]] == ["r1"] and "robot.json" in caplog.text
