"""Where simulated robots start: never one in another."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.simulation.simulation import Simulation
from mrslam.spatial import InputError, OccupancyGrid, write_map


def simulation(*starts: list[float] | None, seed: int = 0) -> Simulation:
    robots: list[dict[str, Any]] = [
        {"id": f"r{i}", **({} if start is None else {"start": start})} for i, start in enumerate(starts)
    ]
    tables = {"world": {"name": "arena1"}, "robots": robots, "mission": {"seed": seed}}
    return Simulation(make_mission(tables, Path("m.toml")))


@pytest.mark.parametrize("other", [[2.0, 2.0, 1.0], [2.2, 2.2, 0.0]])
def test_two_robots_in_one_place_are_refused(other: list[float]) -> None:
    with pytest.raises(InputError, match=r"robots r0 and r1 start .* apart, one in the other; keep them 0\.36 m"):
        simulation([2.0, 2.0, 0.0], other)


def test_starts_beside_each_other_are_taken_as_they_are() -> None:
    starts = simulation([2.0, 2.0, 0.0], [2.4, 2.0, 1.0]).starts
    assert starts["r0"].tolist() == [2.0, 2.0, 0.0] and starts["r1"].tolist() == [2.4, 2.0, 1.0]


def test_robots_that_start_at_random_keep_off_the_given_starts() -> None:
    for seed in range(20):
        starts = simulation(None, None, [2.0, 2.0, 0.0], None, seed=seed).starts
        gaps = [np.hypot(*(a - b)[:2]) for a, b in combinations(starts.values(), 2)]
        assert min(gaps) > 0.36


def test_links_are_alike_both_ways_and_as_the_radio_has_them() -> None:
    truth = simulation([2.0, 2.0, 0.0], [2.6, 2.0, 1.0], None)
    truth.advance(0)
    told = {robot_id: truth.qualities(robot_id) for robot_id in truth.starts}
    for a, b in combinations(truth.starts, 2):
        expected = truth.radio.quality(truth.starts[a], truth.starts[b])
        assert told[a][b] == told[b][a] == pytest.approx(expected) and expected > 0.0


def test_a_robot_that_is_carried_off_is_never_put_down_in_another() -> None:
    truth = simulation(*[None] * 8)
    for seed in range(25):
        truth.kidnap("r0", 3.0, np.random.default_rng(seed))
        r0, *others = truth.fleet.T_world_base().values()
        assert min(np.hypot(*(r0 - other)[:2]) for other in others) > 0.36


def test_starts_outside_of_the_floor_are_refused() -> None:
    with pytest.raises(InputError, match=r"robot r0: start -5, 2 is no floor of the world arena1, which has x from 0"):
        simulation([-5.0, 2.0, 0.0])


def to_waypoint(world: str, waypoint: list[float]) -> Simulation:
    robot = {"id": "r0", "start": [2.0, 2.0, 0.0], "driver": "waypoints", "waypoints": [[2.5, 2.0], waypoint]}
    return Simulation(make_mission({"world": {"name": world}, "robots": [robot]}, Path("m.toml")))


def test_waypoints_where_nobody_can_arrive_are_refused(tmp_path: Path) -> None:
    cells = np.zeros((80, 120), dtype=np.int8)
    cells[[0, -1], :] = cells[:, [0, -1]] = cells[:, 60] = 100  # two rooms, no door
    world = str(tmp_path / "rooms.yaml")
    write_map(Path(world), OccupancyGrid(cells, 0.05, (0.0, 0.0)))
    assert to_waypoint(world, [1.0, 3.0]).starts["r0"].tolist() == [2.0, 2.0, 0.0]
    with pytest.raises(InputError, match=r"robot r0: waypoint 3\.02, 1 is no floor of the world .*, which has"):
        to_waypoint(world, [3.02, 1.0])
    with pytest.raises(InputError, match=r"robot r0: no floor leads from its start to the waypoint 5, 1"):
        to_waypoint(world, [5.0, 1.0])
