"""What users need is judged: each of these goes wrong here, and is said."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from bench.chaos.invariants import Invariants
from bench.chaos.knowledge import Knowledge
from bench.chaos.merging import UNMERGED_MOST, alike
from bench.chaos.scene import Report, Scene
from bench.chaos.team_maps import PRECISION, TeamMaps, _other_frames
from mrslam.agent import Agent
from mrslam.merge.grids.warp import warp
from mrslam.sim_driver.evaluate.truth import Judge
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam, run_in_virtual_time
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import OccupancyGrid, se2

S = 1_000_000_000
LENGTH_S, REST_S = 30.0, 24.0


def violations(folder: Path, spoil: Any, **tables: Any) -> list[str]:
    """Play two robots in a small world, spoil what ``spoil(agent, other's id, time)`` does, and return what is said."""
    mission = make_mission(
        {
            "mission": {"shell": "virtual", "duration_s": LENGTH_S, "seed": 4},
            "world": {"name": "arena2"},
            "robots": [{"id": robot, "laser": "lidar-360"} for robot in ("r1", "r2")],
            "rbpf": {"particles": 3, "threads": 1},
            "comms": {"exchange_timeout_s": 2.0},
            "agent": {"align_interval_s": 4.0},
            "faults": [
                {"kind": "laser_off", "robot": robot, "at_s": REST_S, "for_s": LENGTH_S} for robot in ("r1", "r2")
            ],
            **tables,
        },
        folder / "judged.toml",
    )
    world = make_world(mission)
    invariants = Invariants(mission, Judge(world.grid, world.reachable))

    def watch(team: VirtualTeam, now_ns: int) -> None:
        spoil(team.robots[0].runner.agent, "r2", now_ns / S)  # type: ignore[attr-defined]
        invariants(team, now_ns)
        if now_ns / S >= LENGTH_S - 0.15:
            invariants.at_end(team, now_ns)

    run_in_virtual_time(mission, folder, lambda mission_s, total_s, text: None, watch)
    return invariants.violations


def nothing(agent: Agent, other: str, now_s: float) -> None:
    """Leave the mission as it is."""


def test_an_unspoilt_mission_breaks_nothing(tmp_path: Path) -> None:
    assert violations(tmp_path, nothing) == []


def test_a_pair_that_is_merged_and_unmerged_by_turns_is_said_once(tmp_path: Path) -> None:
    def spoil(agent: Agent, other: str, now_s: float) -> None:
        if now_s < 20.0:
            return
        agent.T_team_map.pop(other, None)
        if int(10 * now_s) % 4 < 2:
            agent.T_team_map[other] = np.zeros(3)

    said = violations(tmp_path, spoil)
    assert [line.split(": ")[1] for line in said if "unmerged" in line] == [
        f"r1 unmerged the map of r2 {UNMERGED_MOST + 1} times"
    ]


def test_a_doubtful_robot_that_publishes_is_heard(tmp_path: Path) -> None:
    def spoil(agent: Agent, other: str, now_s: float) -> None:
        if now_s > 15.0:
            agent.self_doubt.doubtful = True
            agent.publish(round(now_s * S))

    assert any("published its map though it doubts" in line for line in violations(tmp_path, spoil))


def test_a_robot_that_is_sure_and_elsewhere_is_seen(tmp_path: Path) -> None:
    def spoil(agent: Agent, other: str, now_s: float) -> None:
        if now_s > 15.0:
            agent.mapper._reported.T_map_key = agent.mapper._reported.T_map_key + np.array([3.0, 0.0, 0.0])

    assert any("is sure, and" in line for line in violations(tmp_path, spoil))


def test_a_team_map_with_wrong_walls_is_seen(tmp_path: Path) -> None:
    def spoil(agent: Agent, other: str, now_s: float) -> None:
        if now_s > LENGTH_S - 0.3:
            grid = agent.team_map().grid
            cells = grid.cells.copy()
            cells[grid.is_free] = 100
            agent.team._map = replace(agent.team_map(), grid=replace(grid, cells=cells))

    said = violations(tmp_path, spoil)
    assert any("of the walls in the team map of r1 are true" in line for line in said)


@pytest.mark.parametrize(("quality", "lines"), [(0.9, 1), (0.1, 0)])
def test_robots_that_hear_each_other_know_the_same_in_the_end(quality: float, lines: int) -> None:
    def knows(revision: int) -> Any:
        store = SimpleNamespace(digest=lambda: {"r1": (1, revision)})
        return SimpleNamespace(node=SimpleNamespace(must_stop=False, store=store))

    radio = SimpleNamespace(quality=lambda a, b: quality)
    team, report, nowhere = SimpleNamespace(simulation=SimpleNamespace(radio=radio)), Report(), {"r1": None, "r2": None}
    scene = SimpleNamespace(agents={"r1": knows(2), "r2": knows(1)}, team=team, T_world_base=nowhere)
    scene.hears = partial(Scene.hears, scene)
    Knowledge(report).at_end(scene)
    assert len(report.violations) == lines


def test_a_robot_that_a_map_has_no_place_for_stands_in_it_rightly() -> None:
    world = load_world("arena2", None)
    maps, scene = TeamMaps(Report()), SimpleNamespace(judge=Judge(world.grid, world.reachable))
    cells = world.grid.cells.copy()
    row, col = np.argwhere(world.reachable)[world.reachable.sum() // 2]
    cells[row - 2 : row + 3, col - 2 : col + 3] = 100
    body = world.reachable & (cells == 100)
    maps._ways["r2"].append(world.grid.centres(body).mean(axis=0))
    grid = replace(world.grid, cells=cells)
    assert maps._precision(scene, grid, se2.IDENTITY, {"r2"}) == 1.0
    assert maps._precision(scene, grid, se2.IDENTITY, set()) < 1.0


def test_a_way_before_a_robot_gave_its_map_up_says_nothing_of_ghosts() -> None:
    maps = TeamMaps(Report())
    for k, epoch in enumerate((1, 1, 1, 2, 2)):
        agent = SimpleNamespace(node=SimpleNamespace(store=SimpleNamespace(own_epoch=epoch), must_stop=False))
        place = se2.transform(float(k), 0.0, 0.0)
        maps.step(SimpleNamespace(agents={"r1": agent}, now_s=0.1 * k, T_world_base={"r1": place, "r2": place}))
    assert maps._where({"r1"}, of_this_map=True)[:, 0].tolist() == [3.0, 4.0]
    assert (
        maps._where({"r2"}, of_this_map=True)[:, 0].tolist()
        == maps._where({"r1"})[:, 0].tolist()
        == [0.0, 1.0, 2.0, 3.0, 4.0]
    )


@pytest.mark.parametrize(
    ("must_stop", "seen_at_m", "counts"), [(True, 1.5, False), (True, 0.6, True), (False, 1.5, True)]
)
def test_a_robot_that_stopped_is_no_ghost_where_it_stands(must_stop: bool, seen_at_m: float, counts: bool) -> None:
    world = OccupancyGrid(np.zeros((20, 40), dtype=np.int8), 0.1)
    cells = world.cells.copy()
    cells[9:12, round(seen_at_m / 0.1) - 1 : round(seen_at_m / 0.1) + 2] = 100
    maps, judge = TeamMaps(Report()), Judge(world, world.cells == 0)
    for k in range(6):
        node = SimpleNamespace(store=SimpleNamespace(own_epoch=1), must_stop=must_stop and k == 5)
        places = {"r2": se2.transform(0.3 * k, 1.05, 0.0)}
        maps.step(SimpleNamespace(agents={"r2": SimpleNamespace(node=node)}, now_s=0.1 * k, T_world_base=places))
    ghosts = maps._ghosts(SimpleNamespace(judge=judge), replace(world, cells=cells), se2.IDENTITY, {"r1", "r2"})
    assert ghosts == 9 * counts


def test_walls_may_be_as_far_off_as_a_robot_says_that_it_is_unsure() -> None:
    cells = np.zeros((60, 60), dtype=np.int8)
    cells[30] = 100
    grid = OccupancyGrid(cells, 0.05)
    maps, scene = TeamMaps(Report()), SimpleNamespace(judge=Judge(grid, cells == 0))
    off = se2.transform(0.0, 0.15, 0.0)
    assert maps._precision(scene, grid, off, set()) < PRECISION
    assert maps._precision(scene, grid, off, set(), unsure_m=0.06) == 1.0


def test_walls_of_a_robot_that_drove_blind_are_true_in_one_of_its_frames() -> None:
    world = load_world("arena2", None)
    judge, (_, width) = Judge(world.grid, world.reachable), world.grid.shape
    begun, now = se2.IDENTITY, se2.transform(0.3, 0.2, 0.02)
    cells = np.where(np.arange(width) < width // 2, world.grid.cells, 0)  # seen before
    after = warp(world.grid, se2.between(now, begun), world.grid.resolution_m)
    rows, cols = np.nonzero(after.is_occupied)  # seen since, drawn where the robot believes to be
    rows, cols = rows + after.cell0[0] - world.grid.cell0[0], cols + after.cell0[1] - world.grid.cell0[1]
    later = (cols > width // 2) & (cols < width) & (rows >= 0) & (rows < cells.shape[0])
    cells[rows[later], cols[later]] = 100
    grid = replace(world.grid, cells=cells.astype(np.int8))
    store = SimpleNamespace(version=lambda name: (1, 1))
    agent = SimpleNamespace(
        robot_id="r1", node=SimpleNamespace(store=store), team_map=lambda: SimpleNamespace(T_team_map={"r1": begun})
    )
    scene = SimpleNamespace(judge=judge, frame=lambda holder, name: begun, frame_now=lambda holder, name: now)
    or_at = _other_frames(scene, agent, now)
    maps, path = TeamMaps(Report()), world.grid.centres(world.reachable)
    assert maps._precision(scene, grid, now, set()) < PRECISION < 0.99
    assert maps._precision(scene, grid, now, set(), 0.0, or_at) > 0.99
    assert judge.ghosts(grid, now, path, 0.2) > 100 > judge.ghosts(grid, now, path, 0.2, or_at)
    scene.frame_now = scene.frame
    assert _other_frames(scene, agent, now) == []


@pytest.mark.parametrize(("name", "low", "high"), [("symmetric-house", 0.9, 1.0), ("arena2", 0.0, 0.6)])
def test_a_world_that_looks_alike_when_turned_is_known(name: str, low: float, high: float) -> None:
    world = load_world(name, None)
    assert low <= alike(Judge(world.grid, world.reachable)) <= high


def test_nobody_waits_for_a_robot_that_stopped_because_another_had_its_id(tmp_path: Path) -> None:
    lasers = [{"kind": "laser_off", "robot": robot, "at_s": REST_S, "for_s": LENGTH_S} for robot in ("r1", "r2")]
    faults = [
        {"kind": "amnesia", "robot": "r1", "at_s": 2.0, "for_s": 4.0},
        {"kind": "twin", "robot": "r1", "at_s": 3.0, "for_s": 8.0},  # up when the first one comes back
        *lasers,
    ]
    stopped = []

    def spoil(agent: Agent, other: str, now_s: float) -> None:
        stopped.append(agent.node.must_stop)

    assert [line for line in violations(tmp_path, spoil, faults=faults) if "recovered" in line] == []
    assert stopped[-1]
