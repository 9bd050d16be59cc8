"""The assessment of each robot alone."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.judges import References, pair_judge
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.robot_rows import robot_rows
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.spatial import OccupancyGrid, write_map
from mrslam.spatial.distance import euclidean
from mrslam.spatial.files.tum import write_tum

TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual"},
    "world": {"name": "arena1"},
    "robots": [{"id": "r1"}, {"id": "r2"}],
}


def test_ghosts_in_a_robots_map_are_what_stands_where_others_drove_not_where_it_did(tmp_path: Path) -> None:
    mission = make_mission(TABLES, tmp_path / "m.toml")
    world = make_world(mission)
    wall_m = euclidean(np.ascontiguousarray(world.grid.is_occupied)) * world.resolution_m
    floor_m = world.grid.centres(world.reachable & (wall_m > 0.5))
    own_m = floor_m[0]
    others_m = floor_m[np.hypot(*(floor_m - own_m).T) > 2.0][0]
    run = RunResults.of(mission, tmp_path)
    cells = np.zeros(world.grid.shape, dtype=np.int8)
    for x, y in (own_m, others_m, others_m + np.array([world.resolution_m, 0.0])):
        col, row = np.floor((np.array([x, y]) - world.grid.origin_m) / world.resolution_m).astype(int)
        cells[row, col] = 100
    for robot, at_m in (("r1", own_m), ("r2", others_m)):
        x, y = world.grid.origin_m[0] - at_m[0], world.grid.origin_m[1] - at_m[1]  # a map begins where its robot does
        for name in ("map.yaml", "team_map.yaml"):
            write_map(tmp_path / robot / name, OccupancyGrid(cells, world.resolution_m, (x, y)))
        write_tum(tmp_path / robot / "trajectory.tum", np.array([0]), np.zeros((1, 3)))
        write_tum(tmp_path / robot / "truth.tum", np.array([0]), np.array([[*at_m, 0.0]]))
        run.robots[robot] = {"mode": "distributed", "known_area_m2": 1.0, "placed": {robot: [0.0, 0.0, 0.0]}}
    rows = robot_rows(pair_judge(run, References()), References(), [])
    assert [rows[robot]["map"]["ghost_cells"] for robot in ("r1", "r2")] == [2, 1]
    assert not run.damage
