"""A base station that maps nothing puts together what robots send that merge nothing."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import Agent, Settings, checkpoint, resume
from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.report.data import page_data
from tests.agent.test_team import arrives, merged, room
from tests.sim_driver.runs import played

TABLES = {
    "mission": {"shell": "virtual", "seed": 3, "duration_s": 40.0},
    "world": {"name": "arena1"},
    "robots": [
        {"id": "base", "mode": "central"},
        {"id": "r1", "mode": "mapper", "start": [2.0, 2.0, 0.0]},
        {"id": "r2", "mode": "mapper", "start": [3.0, 2.5, 1.0]},
    ],
    "rbpf": {"particles": 5},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return played(TABLES, tmp_path_factory.mktemp("base") / "run")


def test_the_base_has_the_teams_map(run: Path) -> None:
    base = json.loads((run / "base" / "robot.json").read_text())
    assert base["frame"] in ("r1", "r2") and sorted(base["placed"]) == ["r1", "r2"]
    metrics = json.loads((run / "metrics.json").read_text())
    (pair,) = metrics["pairs"]
    assert (pair["a"], pair["b"], pair["status"], pair["accepted_by"]) == ("r1", "r2", "accepted", ["base"])
    team = metrics["team"]
    assert team["coverage_by_robot"]["base"] > 0.9
    assert (team["false_merges"], team["missed_merges"], team["one_sided_merges"]) == (0, 0, 0)


def test_it_is_judged_by_the_truth(run: Path) -> None:
    judged = assess(run)
    (pair,) = judged["pairs"]
    assert pair["verdict"] == "correct merge" and pair["error_m"] < 0.1
    assert judged["robots"]["base"]["map"]["coverage_team"] > 0.9
    assert judged["robots"]["base"]["map"]["coverage_own"] is None
    assert not [told for told in judged["not_judged"] if told.startswith("base, trajectory")]


def test_a_robot_that_merges_nothing_has_its_own_map(run: Path) -> None:
    results = RunResults.read(run)
    for robot_id in ("r1", "r2"):
        assert results.robots[robot_id]["placed"] == {robot_id: [0.0, 0.0, 0.0]}
        assert results.map(robot_id, "team_map").known_area_m2() == pytest.approx(
            results.map(robot_id).known_area_m2(), rel=0.01
        )


def test_the_page_tells_of_it(run: Path) -> None:
    told = page_data(RunResults.read(run))
    assert told["headline"] == "base has the maps of all 2 robots in one"
    assert any(
        mood == "good" and text.startswith("base merged the maps of r1 and r2") for mood, text in told["sentences"]
    )
    assert sorted(name for name, s in told["map"]["joined_s"].items() if s is not None) == ["r1", "r2"]
    assert told["map"]["meetings"] and told["coverage"]["curves"]["base"]["team"][-1] > 90.0
    assert write_report(run).exists()


def test_a_base_keeps_its_frame_over_a_restart(tmp_path: Path) -> None:
    base = Agent("base", Settings(), mode="central")
    arrives(base, "b", room())
    assert base.team_map().anchor == "b" and list(base.T_team_map) == ["b"]
    arrives(base, "a", room())
    merged(base)
    assert base.team_map().anchor == "b" and not np.any(base.T_team_map["b"])
    checkpoint.write(checkpoint.freeze(base), tmp_path / "checkpoint")
    again = Agent("base", Settings(), mode="central")
    resume(again, tmp_path / "checkpoint")
    assert again.team_map().anchor == "b" and sorted(again.T_team_map) == ["a", "b"]
    alone = Agent("base", Settings(), mode="central")
    assert alone.team_map().anchor is None and not alone.T_team_map
