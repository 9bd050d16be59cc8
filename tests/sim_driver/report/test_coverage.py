"""How much each robot knew over time."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.report.coverage import CURVE_POINTS, coverage_data
from mrslam.sim_driver.report.layout import Layout
from mrslam.sim_driver.simulation.simulation import make_world

MISSION = make_mission({"world": {"name": "arena1"}, "robots": [{"id": "r1"}, {"id": "r2"}]}, Path("m.toml"))


def layout(cells: np.ndarray, cell_m: float = 1.0) -> Layout:
    return Layout("r1", "r1", {"r1": np.zeros(3), "r2": np.zeros(3)}, ("r1", "r2"), cell_m, cells.astype(np.int8))


def run(events: list[dict[str, Any]], T_world_map: dict[str, np.ndarray]) -> Any:
    robot = {"placed": {"r1": [0.0, 0.0, 0.0], "r2": [0.0, 0.0, 0.0]}}
    return SimpleNamespace(mission=MISSION, T_world_map=T_world_map, robots={"r1": robot}, events={"r1": events})


def test_a_teammates_places_are_known_once_it_is_merged_and_as_far_as_it_had_told() -> None:
    events: list[dict[str, Any]] = [
        {"event": "map_updated", "robot_id": "r2", "t": 2.0},
        {"event": "merged", "a": "r1", "b": "r2", "t": 4.0},
        {"event": "map_updated", "robot_id": "r2", "t": 6.0},
    ]
    first_s = {"r1": [[0.0, np.inf, np.inf, np.inf]], "r2": [[np.inf, 1.0, 3.0, 7.0]]}
    seen_s = {robot: np.array(places, dtype=np.float32) for robot, places in first_s.items()}
    told = coverage_data(run(events, {}), layout(np.ones((1, 4))), seen_s, CURVE_POINTS - 1.0)
    assert told["unit"] == "m²" and told["times"][:9] == list(range(9))
    assert told["curves"]["r1"]["own"][:9] == [1.0] * 9
    assert told["curves"]["r1"]["team"][:9] == [1.0, 1.0, 1.0, 1.0, 2.0, 2.0, 3.0, 3.0, 3.0]


def test_what_two_others_merged_is_known_once_one_of_them_is_merged_with_the_robot() -> None:
    events: list[dict[str, Any]] = [{"event": "map_updated", "robot_id": name, "t": 1.0} for name in ("r2", "r3")]
    events += [{"event": "merged", "a": a, "b": b, "t": t} for a, b, t in (("r2", "r3", 2.0), ("r1", "r2", 6.0))]
    seen_s = {f"r{k + 1}": np.where(np.arange(3) == k, 0.0, np.inf).astype(np.float32)[None] for k in range(3)}
    told = run(events, {})
    told.robots["r1"]["placed"]["r3"] = [0.0, 0.0, 0.0]
    team = coverage_data(told, layout(np.ones((1, 3))), seen_s, CURVE_POINTS - 1.0)["curves"]["r1"]["team"]
    assert team[:8] == [1.0] * 6 + [3.0] * 2


def test_a_robot_that_mapped_half_a_world_knows_half_of_it() -> None:
    world = make_world(MISSION)
    x, _ = world.grid.centres(world.reachable).T
    middle_m = float(np.median(x))
    cells = np.ones((int(np.ceil(world.size_m[1] / 0.1)), round(middle_m / 0.1)))  # the picture ends there
    at_origin = {"r1": np.array([*world.grid.origin_m, 0.0])}
    seen_s = {robot: np.zeros(cells.shape, np.float32) for robot in ("r1", "r2")}
    told = coverage_data(run([], at_origin), layout(cells, 0.1), seen_s, 1.0)
    assert told["unit"] == "%" and told["curves"]["r1"]["own"][-1] == pytest.approx(50.0, abs=2.0)
