"""A run's folder, read: which frame and which time a robot's numbers are of, and what is not believed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.evaluate.results import RunResults, link_totals
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.spatial import se2
from mrslam.spatial.files.tum import write_tum

S = 1_000_000_000
TRUTH = np.stack([np.arange(60.0), np.zeros(60), np.full(60, 0.5)], axis=1)


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """One simulated robot, whose laser is 0.05 m before its base; its last map begins at 30 s."""
    (tmp_path / "r1").mkdir()
    write_tum(tmp_path / "r1" / "truth.tum", np.arange(60) * S, TRUTH)
    write_tum(tmp_path / "r1" / "trajectory.tum", np.arange(30, 60) * S, TRUTH[:30])
    return tmp_path


def read(folder: Path) -> RunResults:
    tables: dict[str, Any] = {
        "mission": {"shell": "virtual"},
        "world": {"name": "arena1"},
        "robots": [{"id": "r1", "laser": "urg-04lx"}],
    }
    return RunResults.of(make_mission(tables, folder / "one.toml"), folder)


def test_a_map_lies_where_its_first_scan_was_taken_not_where_the_robot_set_out(folder: Path) -> None:
    assert read(folder).T_world_map["r1"] == pytest.approx(TRUTH[30])


def test_of_a_robot_that_was_lost_it_lies_where_its_last_map_began(folder: Path) -> None:
    (folder / "r1" / "trajectory.tum").unlink()
    events = [{"t": 0.0, "event": "mapped"}, {"t": 39.0, "event": "given_up"}, {"t": 41.2, "event": "mapped"}]
    lines = [json.dumps({"robot": "r1", **event}) for event in events]
    (folder / "r1" / "events.jsonl").write_text("\n".join(lines) + "\n")
    assert read(folder).T_world_map["r1"] == pytest.approx(TRUTH[41])


def test_the_true_way_is_that_of_the_laser(folder: Path) -> None:
    way = read(folder).laser_truth("r1")
    assert way is not None
    assert way[1] == pytest.approx(se2.compose(TRUTH, np.array([0.05, 0.0, 0.0])))


def test_a_base_stations_map_lies_in_the_frame_of_the_robot_that_it_names(folder: Path) -> None:
    run = read(folder)
    run.robots.update({"base": {"frame": "r1"}, "r1": {"frame": None}, "r2": {}})
    places = {"r1": np.array([1.0, 2.0, 0.3])}
    assert {robot: frame.tolist() for robot, frame in run.team_frames(places).items()} == {
        "base": [1.0, 2.0, 0.3],
        "r1": [1.0, 2.0, 0.3],
    }


def test_an_exchange_is_one_for_both_its_robots_and_bytes_are_those_of_both() -> None:
    def side(peer: str, exchanges: int, sent: int) -> dict[str, Any]:
        return {"peer": peer, "exchanges": exchanges, "bytes_sent": sent, "bytes_full_lz4": 3, "bytes_full_raw": 7}

    robots = {
        "r1": {"links": [side("r2", 4, 100), side("r3", 9, 900)]},
        "r2": {"links": [side("r1", 5, 20)]},
        "r3": {"links": []},
    }
    assert link_totals(robots, "r1", "r2") == {
        "a": "r1", "b": "r2", "exchanges": 5, "bytes_sent": 120, "bytes_full_lz4": 6, "bytes_full_raw": 14,
    }  # fmt: skip
    assert link_totals(robots, "r2", "r3")["exchanges"] == 0


def test_what_another_robot_left_is_not_taken_for_its_own(folder: Path) -> None:
    robot = {
        "id": "r2", "mode": "mapper", "known_area_m2": 1.0, "team_area_m2": 1.0, "placed": {}, "pairs": [], "links": [],
    }  # fmt: skip
    path = folder / "r1" / "robot.json"
    path.write_text(json.dumps(robot))
    run = read(folder)
    assert run.robots_lost == ["r1"] and run.damage == [f"{path}: is r2's, not r1's"]
    path.write_text(json.dumps({**robot, "id": "r1"}))
    assert read(folder).robots_lost == []
