"""People walk on the floor, are seen by lasers and are walked into by nobody."""

from __future__ import annotations

import numpy as np

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.robots.walkers import RADIUS_M, ROOM_M, SPEED_M_S, Walkers
from mrslam.sim_driver.simulation.simulation import Simulation
from mrslam.sim_driver.worlds import load_world


def mission(walkers: int, tmp_path):
    robots = [{"id": "r1", "start": [3.0, 5.1, 0.0], "laser": "lidar-360"}]
    tables = {
        "mission": {"name": "w", "shell": "virtual", "seed": 3, "duration_s": 10.0},
        "world": {"name": "office", "walkers": walkers}, "robots": robots,
    }  # fmt: skip
    return make_mission(tables, tmp_path / "w.toml")


def test_people_walk_keep_clear_of_walls_and_robots_and_are_one_seeds() -> None:
    world = load_world("office")
    first, again = (Walkers(world, 6, np.random.default_rng(2)) for _ in range(2))
    begin, robot = first.places_m.copy(), np.array([[3.0, 5.1]])
    away = np.full(6, np.inf)
    for _ in range(300):
        first.step(robot, 0.1)
        again.step(robot, 0.1)
        assert (world.clearance_m(first.places_m) >= ROOM_M - 0.05).all()
        away = np.minimum(away, np.hypot(*(first.places_m - begin).T))
        assert np.hypot(*(first.places_m - robot).T).min() >= ROOM_M
    assert (np.hypot(*(first.places_m - begin).T) > 0.5).sum() >= 4
    np.testing.assert_array_equal(first.places_m, again.places_m)


def test_lasers_see_people_and_a_mission_without_them_is_as_it_was(tmp_path) -> None:
    def ranges(count: int) -> np.ndarray:
        simulation = Simulation(mission(count, tmp_path))
        if simulation.fleet.walkers is not None:
            simulation.fleet.walkers.places_m[0] = (5.0, 5.1)
        simulation.advance(0)
        return simulation.take("r1")[0].scan.ranges_m

    alone, crowded = ranges(0), ranges(1)
    nearer = crowded < alone - 0.5
    assert nearer.sum() > 3 and abs(float(crowded[nearer].min()) - 1.82) < 0.05
    assert (crowded == alone).mean() > 0.9


def test_people_walk_at_their_speed_and_into_nobody() -> None:
    walkers = Walkers(load_world("office"), 20, np.random.default_rng(2))
    before = walkers.places_m.copy()
    walkers.step(np.empty((0, 2)), 0.1)
    stepped_m = np.hypot(*(walkers.places_m - before).T)
    assert (stepped_m > 0.0).sum() > 10 and stepped_m.max() <= 0.1 * SPEED_M_S[1]
    robots, before = walkers.places_m + 0.3, walkers.places_m.copy()  # each has a robot in its way
    for _ in range(50):
        walkers.step(robots, 0.1)
    assert (np.hypot(*(walkers.places_m - before).T) > 0.5).sum() < 20
    gaps = np.hypot(*(walkers.places_m[:, None] - robots[None]).transpose(2, 0, 1)).min(axis=1)
    moved = (walkers.places_m != before).any(axis=1)
    assert (gaps[moved] >= RADIUS_M + ROOM_M).all()
