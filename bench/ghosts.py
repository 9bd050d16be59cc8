"""Mutual detection on and off: six robots drive about in one room; the same scans are mapped again without the filter.

    python bench/ghosts.py [--robots 6] [--seeds 1 2 3] [--seconds 120]

One JSON line a seed. ghosts : occupied cells of all robots' final maps farther than 0.2 m from a true wall, with and
without the filter; walls_lost : share of the true wall cells hit by a robot's laser (within 0.1 m of it) that only
masked beams hit, so that the filter took them from its map; walls_differ : share of the true walls that only one of a
robot's two maps shows, whatever for (two maps of one drive differ a little by chance).
"""

from __future__ import annotations

import argparse
import json
import tempfile
from collections import defaultdict
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.spatial import cKDTree

from mrslam.agent import Agent
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.replay.again import replay_mission
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.worlds import World
from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.spatial import Scan, read_map, se2, write_map
from mrslam.spatial.files.tum import read_tum
from mrslam.spatial.se2 import Transform

FAR_M, NEAR_M = 0.2, 0.1


def room() -> World:
    """Return a room of 12 x 8 m that looks different from every corner."""
    plan = Canvas(12.0, 8.0).box(0.1, 6.4, 2.6, 7.9).box(4.0, 2.0, 4.6, 2.4).box(8.6, 5.2, 9.4, 5.6)
    plan.box(9.8, 0.1, 11.9, 1.2).box(6.0, 7.2, 6.8, 7.9).disc(2.2, 2.8, 0.2).disc(7.4, 2.6, 0.3)
    return World("room", plan.grid())


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robots", type=int, default=6)
    parser.add_argument("--seeds", nargs="+", type=int, default=[1, 2, 3])
    parser.add_argument("--seconds", type=float, default=120.0)
    args = parser.parse_args()
    for seed in args.seeds:
        with tempfile.TemporaryDirectory() as scratch:
            print(json.dumps(compare(Path(scratch), args.robots, seed, args.seconds)), flush=True)


def compare(scratch: Path, robots: int, seed: int, seconds: float) -> dict[str, Any]:
    """Drive once, map twice."""
    world, rng = room(), np.random.default_rng(seed)
    write_map(scratch / "room.yaml", world.grid)
    starts: list[Transform] = []
    for _ in range(robots):
        starts.append(world.free_start(rng, 0.3, np.array([start[:2] for start in starts]).reshape(-1, 2)))
    tables = {
        "mission": {"shell": "virtual", "seed": seed, "duration_s": seconds},
        "world": {"name": str(scratch / "room.yaml")},
        "robots": [
            {
                "id": f"r{i + 1}",
                "start": starts[i].tolist(),
                "driver": "waypoints",
                "waypoints": [world.free_start(rng, 0.4)[:2].tolist() for _ in range(40)],
            }
            for i in range(robots)
        ],
        "comms": {"exchange_timeout_s": 10.0},
    }
    mission = make_mission(tables, scratch / "room.toml")
    with noted() as masked:
        metrics = run_mission(mission, scratch / "on", lambda *_: None, lambda text: None)
    again = replay_mission(scratch / "on", ["mutual_detection.enabled=false"])
    run_mission(again, scratch / "off", lambda *_: None, lambda text: None)
    true_walls = world.grid.centres(world.is_wall)
    shown = {kind: [walls(world, scratch / kind / robot.id) for robot in mission.robots] for kind in ("on", "off")}
    ghosts = {kind: sum(ghost_cells(true_walls, points) for points in maps) for kind, maps in shown.items()}
    kept = [(near(true_walls, off), near(true_walls, on)) for off, on in zip(shown["off"], shown["on"], strict=True)]
    differ, shown_off = sum(int((off ^ on).sum()) for off, on in kept), sum(int(off.sum()) for off, _ in kept)
    hits = [wall_hits(true_walls, masked[robot.id], scratch / "on" / robot.id) for robot in mission.robots]
    lost, hit = (sum(int(count) for count in column) for column in zip(*hits, strict=True))
    return {
        "seed": seed, "robots": robots, "mission_s": metrics["mission_s"],
        "masked_beams": sum(robot["masked_beams"] for robot in metrics["robots"]),
        "ghosts_with": ghosts["on"], "ghosts_without": ghosts["off"],
        "ghost_share": round(ghosts["on"] / max(ghosts["off"], 1), 4),
        "walls_lost": round(lost / max(hit, 1), 6), "walls_differ": round(differ / max(shown_off, 1), 4),
    }  # fmt: skip


@contextmanager
def noted() -> Iterator[dict[str, list[tuple[Scan, Scan]]]]:
    """Collect by robot every scan as it came and as it was mapped."""
    seen: dict[str, list[tuple[Scan, Scan]]] = defaultdict(list)
    usual = Agent._without_teammates

    def noting(agent: Agent, scan: Scan, T_odom_base: Transform | None, now_ns: int) -> tuple[Scan, int]:
        kept, count = usual(agent, scan, T_odom_base, now_ns)
        seen[agent.robot_id].append((scan, kept))
        return kept, count

    with patch.object(Agent, "_without_teammates", noting):
        yield seen


def wall_hits(true_walls: np.ndarray, scans: list[tuple[Scan, Scan]], folder: Path) -> tuple[int, int]:
    """Return how many true wall cells only masked beams hit, and how many were hit at all."""
    stamps_ns, poses = read_tum(folder / "truth.tum")
    where = {int(stamp_ns): pose for stamp_ns, pose in zip(stamps_ns, poses, strict=True)}
    tree, hit, mapped = cKDTree(true_walls), np.zeros(len(true_walls), bool), np.zeros(len(true_walls), bool)
    for came, kept in scans:
        pose = where[came.stamp_ns]
        for scan, cells in ((came, hit), (kept, mapped)):
            away_m, nearest = tree.query(se2.apply(pose, scan.points_base()))
            cells[nearest[away_m < NEAR_M]] = True
    return int((hit & ~mapped).sum()), int(hit.sum())


def walls(world: World, folder: Path) -> np.ndarray:
    """Return the occupied cells of a robot's final map ``(N, 2)``, laid over the world as well as they fit."""
    grid = read_map(folder / "map.yaml")
    points, T_world_map = grid.centres(grid.is_occupied), read_tum(folder / "truth.tum")[1][0]
    true_walls = world.grid.centres(world.is_wall)
    tree = cKDTree(true_walls)
    for _ in range(10):
        away_m, nearest = tree.query(se2.apply(T_world_map, points))
        T_world_map = se2.fit_rigid(true_walls[nearest[away_m < 0.3]], points[away_m < 0.3])
    return se2.apply(T_world_map, points)


def ghost_cells(true_walls: np.ndarray, points: np.ndarray) -> int:
    """Return how many cells are far from every true wall."""
    return int((cKDTree(true_walls).query(points)[0] > FAR_M).sum())


def near(true_walls: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return which true wall cells a map shows."""
    return cKDTree(points).query(true_walls)[0] <= NEAR_M


if __name__ == "__main__":
    main()
