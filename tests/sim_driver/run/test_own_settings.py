"""A mission whose robots have settings of their own: mappers of other sizes and resolutions still merge."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.replay.again import mission_of
from mrslam.sim_driver.report.data import page_data
from mrslam.sim_driver.run.run_virtual import VirtualTeam
from tests.sim_driver.runs import played

TABLES = {
    "mission": {"shell": "virtual", "seed": 3, "duration_s": 40.0},
    "world": {"name": "arena1"},
    "robots": [
        {"id": "r1", "start": [2.0, 2.0, 0.0]},
        {"id": "r2", "start": [3.0, 2.5, 1.0], "rbpf": {"particles": 8, "resolution_m": 0.1}},
    ],
    "rbpf": {"particles": 5},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return played(TABLES, tmp_path_factory.mktemp("own") / "run")


def test_every_robot_maps_with_its_own_settings(run: Path, tmp_path: Path) -> None:
    resolutions = {
        robot: yaml.safe_load((run / robot / "map.yaml").read_text())["resolution"] for robot in ("r1", "r2")
    }
    assert resolutions == {"r1": 0.05, "r2": 0.1}
    team = VirtualTeam(make_mission(TABLES, Path("small.toml")), tmp_path)
    assert [robot.runner.agent.mapper.particles_most for robot in team.robots] == [5, 8]


def test_maps_of_two_resolutions_merge_on_both_sides(run: Path) -> None:
    metrics = json.loads((run / "metrics.json").read_text())
    (pair,) = metrics["pairs"]
    assert (pair["status"], pair["accepted_by"]) == ("accepted", ["r1", "r2"])
    assert pair["error_m"] < 0.15 and pair["error_deg"] < 2.0
    assert metrics["team"]["occupied_precision"] > 0.95 and metrics["team"]["false_merges"] == 0


def test_the_run_keeps_them_for_replays_and_shows_them(run: Path) -> None:
    again = mission_of(run, ["rbpf.particles=3"])
    assert {name: one.rbpf.particles for name, one in again.settings_of.items()} == {"r1": 3, "r2": 8}
    assert again.settings_of["r2"].rbpf.resolution_m == 0.1
    rows = page_data(RunResults.read(run))["settings"]
    assert ["r2: rbpf.particles", 8, True] in rows and ["rbpf.particles", 5, True] in rows
