"""What the robots of a mission are given: bodies and drivers in their own frames, and who is within their radio."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.patrol import patrol
from mrslam.agent import Agent, Settings
from mrslam.sim_driver.drivers import TrajectoryDriver, WaypointDriver
from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.missions.traces import LinkTrace
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.run.team import _driver, radio_of, take_saved_maps
from mrslam.spatial import InputError, write_map
from mrslam.spatial.files.tum import read_tum, write_tum
from tests.merge.plans import building

START = [2.0, 3.0, 1.5707963]
S = 1_000_000_000


def mission(folder: Path, *robots: dict[str, Any], **tables: Any) -> Mission:
    listed = [{"id": f"r{k + 1}", **robot} for k, robot in enumerate(robots)]
    return make_mission({"world": {"name": "arena2"}, "robots": listed, **tables}, folder / "m.toml")


@pytest.mark.parametrize("patrol", [True, False])
def test_waypoints_of_the_world_are_driven_to_in_the_robots_own_frame(patrol: bool, tmp_path: Path) -> None:
    robot = {"driver": "waypoints", "start": START, "waypoints": [[2.0, 4.0], [1.0, 3.0]], "patrol": patrol}
    one = mission(tmp_path, robot)
    driver = _driver(one, one.robots[0])
    assert isinstance(driver, WaypointDriver)
    np.testing.assert_allclose(driver._waypoints_m, [[1.0, 0.0], [0.0, 1.0]], atol=1e-6)
    assert driver._loop is patrol


def test_a_robot_finds_its_way_to_rooms_that_it_has_not_seen(tmp_path: Path) -> None:
    tables = {"mission": {"name": "rounds", "seed": 1, "duration_s": 90.0, "shell": "virtual"},
              "world": {"name": "office"}, "robots": [{"id": "r1"}]}  # fmt: skip
    rounds = patrol(tables, "rounds")
    run_mission(rounds, tmp_path, lambda *_: None, lambda _: None)
    _, T_world_base = read_tum(tmp_path / "r1" / "truth.tum")
    away_m = np.hypot(*(T_world_base[:, None, :2] - np.array(rounds.robots[0].waypoints)).transpose(2, 0, 1)).min(
        axis=0
    )
    assert (away_m[:3] < 0.4).all()  # behind walls, and 10 m and more from each other
    assert np.hypot(*np.diff(T_world_base[:, :2], axis=0).T).sum() > 30.0


def test_a_trajectory_of_the_world_is_followed_in_the_robots_own_frame(tmp_path: Path) -> None:
    write_tum(tmp_path / "way.tum", np.array([0, S]), np.array([START, [2.0, 4.0, START[2]]]))
    one = mission(tmp_path, {"driver": "trajectory", "start": START, "trajectory": "way.tum"})
    driver = _driver(one, one.robots[0])
    assert isinstance(driver, TrajectoryDriver)
    np.testing.assert_allclose(driver._xy_m[:, :2], [[0.0, 0.0], [1.0, 0.0]], atol=1e-5)


def test_a_place_in_a_saved_map_is_of_one_map(tmp_path: Path) -> None:
    for name in ("r1", "r2"):
        (tmp_path / "run" / name).mkdir(parents=True)
        write_map(tmp_path / "run" / name / "map.yaml", building(3))
    saved = {"run": (tmp_path / "run", None), "one": (tmp_path / "run" / "r1", None)}
    agent = Agent("a", Settings())
    with pytest.raises(InputError, match="name the one that near is a place of"):
        take_saved_maps(agent, saved, {"run": [1.0, 2.0]})
    assert take_saved_maps(agent, {"run": saved["run"]}) == ["map@r1", "map@r2"]
    assert take_saved_maps(Agent("a", Settings()), {"one": saved["one"]}, {"one": [1.0, 2.0]}) == ["map@r1"]


def test_a_recorded_simulation_knows_the_links_of_its_own_robots_alone(tmp_path: Path) -> None:
    (tmp_path / "links.csv").write_text("0,r1,r2,0.9\n0,r1,r3,0.5\n")
    trace = LinkTrace.read(tmp_path / "links.csv")
    recorded = {"log": "r3.clf"}
    replayed = replace(mission(tmp_path, {}, {}, recorded), replay=tmp_path)
    r1, _, r3 = replayed.robots
    radio = radio_of(replayed, r1, trace, None)
    assert radio is not None and radio.qualities(0) == {"r2": 0.9}
    assert radio_of(replayed, r3, trace, None) is None
