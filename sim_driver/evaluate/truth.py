"""What a simulated mission's outcome is worth, against the world it took place in."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mrslam.sim_driver.evaluate.trajectories import Trajectory
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import MAP_FILE, TEAM_MAP_FILE, TRAJECTORY_FILE, TRUTH_FILE
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.spatial import UNKNOWN, OccupancyGrid, read_map, se2
from mrslam.spatial.distance import euclidean
from mrslam.spatial.files.tum import read_tum
from mrslam.spatial.se2 import Transform

FALSE_MERGE_M, FALSE_MERGE_DEG = 0.5, 5.0
"""An accepted transform farther off than this is a false merge."""
MUST_MERGE = 0.3
"""Pairs whose maps share at least this part of the smaller one should have merged."""
NEAR_WALL_CELLS = 2.0
"""Up to this far, cells of the robot's map, is near a wall."""
MARGIN_M = 1.0
"""How far outside of a world distances to its walls are known."""


def true_trajectories(mission: Mission, folder: Path) -> dict[str, Trajectory]:
    """Return the true poses of the bases of simulated robots in the world frame, by id."""
    paths = {robot.id: folder / robot.id / TRUTH_FILE for robot in mission.robots}
    return {robot_id: read_tum(path) for robot_id, path in paths.items() if path.exists()}


def true_starts(truth: Mapping[str, Trajectory], folder: Path) -> dict[str, Transform]:
    """Return ``T_world_map`` of every simulated robot: its map's frame is its pose at the map's first scan.

    That is not where it set out if it gave its map up, or lost it, and began a new one.
    """
    found = {}
    for robot_id, (stamps_ns, poses) in truth.items():
        mapped = folder / robot_id / TRAJECTORY_FILE
        first_ns = read_tum(mapped)[0][:1] if mapped.exists() else stamps_ns[:1]
        if len(poses):
            found[robot_id] = poses[int(np.abs(stamps_ns - first_ns).argmin()) if first_ns.size else 0]
    return found


def pair_error(T_a_b: Transform, T_world_a: Transform, T_world_b: Transform) -> tuple[float, float]:
    """Return how far ``T_a_b`` is from the truth: metres at map b's origin, and degrees."""
    distance_m, angle_rad = se2.difference(T_a_b, se2.between(T_world_a, T_world_b))
    return distance_m, float(np.degrees(angle_rad))


def team_frames(starts: Mapping[str, Transform], robots: Mapping[str, Mapping[str, Any]]) -> dict[str, Transform]:
    """Return where robots' team maps truly lie: where their own maps do, a base station's where its frame's map does.

    ``starts`` : where maps lie; ``robots`` : each robot's ``robot.json``.
    """
    frames = {robot_id: robot.get("frame", robot_id) for robot_id, robot in robots.items()}
    return {robot_id: starts[frame] for robot_id, frame in frames.items() if frame in starts}


def team_figures(
    mission: Mission,
    folder: Path,
    robots: Mapping[str, Mapping[str, Any]],
    starts: Mapping[str, Transform],
    pairs: list[dict[str, Any]],
) -> dict[str, Any] | None:
    """Return coverage, precision and merge counts of a simulated mission, by :func:`true_starts`; None without any."""
    frames = team_frames(starts, robots)
    if mission.world is None or not frames:
        return None
    judge = Judge(make_world(mission).grid, make_world(mission).reachable)
    per_robot = {}
    for robot_id, T_world_team in frames.items():
        team = read_map(folder / robot_id / TEAM_MAP_FILE)
        per_robot[robot_id] = (judge.coverage(team, T_world_team), judge.occupied_precision(team, T_world_team))
    accepted = [pair for pair in pairs if pair["status"] == "accepted"]
    false = [
        p
        for p in accepted
        if p["error_m"] is not None and (p["error_m"] > FALSE_MERGE_M or p["error_deg"] > FALSE_MERGE_DEG)
    ]
    mapped = starts.keys() & robots.keys()
    maps = {robot_id: read_map(folder / robot_id / MAP_FILE) for robot_id in mapped}
    done = {(pair["a"], pair["b"]) for pair in accepted}
    missed = [
        (a, b)
        for a, b in combinations(sorted(mapped), 2)
        if (a, b) not in done and overlap(maps[a], maps[b], starts[a], starts[b]) >= MUST_MERGE
    ]
    return {
        "coverage": round(max(coverage for coverage, _ in per_robot.values()), 4),
        "occupied_precision": round(min(precision for _, precision in per_robot.values()), 4),
        "coverage_by_robot": {robot: round(values[0], 4) for robot, values in per_robot.items()},
        "false_merges": len(false),
        "missed_merges": len(missed),
        "one_sided_merges": sum(pair["both_at_s"] is None for pair in accepted),
    }


@dataclass(frozen=True, eq=False)
class Judge:
    """A world to hold maps against."""

    world: OccupancyGrid
    reachable: NDArray[np.bool_]
    """``(H, W)`` the floor that counts."""

    @cached_property
    def _walls(self) -> tuple[OccupancyGrid, NDArray[np.float32]]:
        """The world with a margin, for walls stand at its edge, and the distance to the nearest of them, metres."""
        grid, margin = self.world, math.ceil(MARGIN_M / self.world.resolution_m)
        x, y = (float(one) - margin * grid.resolution_m for one in grid.origin_m)
        wide = OccupancyGrid(np.pad(grid.cells, margin, constant_values=UNKNOWN), grid.resolution_m, (x, y))
        return wide, euclidean(np.ascontiguousarray(wide.is_occupied)) * np.float32(grid.resolution_m)

    def _wall_m(self, points: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return how far points ``(N, 2)`` of the world are from the nearest true wall, metres; inf far outside."""
        return field_at(*self._walls, points)

    def coverage(self, grid: OccupancyGrid, T_world_map: Transform) -> float:
        """Return the share of the reachable floor that the map knows to be free, 0..1."""
        floor = se2.apply(se2.inverse(T_world_map), self.world.centres(self.reachable))
        return float(np.mean(values_at(grid, floor) == 0)) if len(floor) else 0.0

    def occupied_precision(self, grid: OccupancyGrid, T_world_map: Transform) -> float:
        """Return the share of the map's walls within two cells of a true wall, 0..1; 1 where it has none."""
        walls = se2.apply(T_world_map, grid.centres(grid.is_occupied))
        if len(walls) == 0:
            return 1.0
        return float(np.mean(self._wall_m(walls) <= _near_m(grid)))

    def occupied_recall(self, grid: OccupancyGrid, T_world_map: Transform) -> float | None:
        """Return the share of the true walls beside known floor that the map has within two cells; None without floor.

        Only the faces of walls count: a laser sees no wall from within.
        """
        face = self.world.is_occupied & (euclidean(np.ascontiguousarray(self.reachable)) <= 1.5)
        points = se2.apply(se2.inverse(T_world_map), self.world.centres(face))
        free_m = euclidean(np.ascontiguousarray(grid.is_free)) * grid.resolution_m
        wall_m = euclidean(np.ascontiguousarray(grid.is_occupied)) * grid.resolution_m
        seen = field_at(grid, free_m, points) <= _near_m(grid)
        if not seen.any():
            return None
        return float(np.mean(field_at(grid, wall_m, points[seen]) <= _near_m(grid)))

    def free_agreement(self, grid: OccupancyGrid, T_world_map: Transform) -> float | None:
        """Return the share of the map's free cells that lie on true floor or within two cells of it."""
        points = se2.apply(T_world_map, grid.centres(grid.is_free))
        if len(points) == 0:
            return None
        far_m = euclidean(np.ascontiguousarray(~self.world.is_occupied)) * self.world.resolution_m
        return float(np.mean(field_at(self.world, far_m, points) <= _near_m(grid)))

    def contradiction_m(
        self, shown: tuple[OccupancyGrid, Transform], to: tuple[OccupancyGrid, Transform], moved: Transform
    ) -> float:
        """Return how much wall of a map stands, moved in the world, on true floor that another map shows; metres.

        Both maps come with where they lie in the world, ``T_world_map``.
        """
        walls = se2.apply(se2.compose(moved, shown[1]), shown[0].centres(shown[0].is_occupied))
        is_floor = self._wall_m(walls) > 2.0 * _near_m(shown[0])
        is_shown = values_at(to[0], se2.apply(se2.inverse(to[1]), walls)) == 0
        return float(np.count_nonzero(is_floor & is_shown)) * shown[0].resolution_m

    def ghosts(self, grid: OccupancyGrid, T_world_map: Transform, paths: NDArray[np.float64], radius_m: float) -> int:
        """Return how many wall cells of the map stand where teammates drove, away from true walls.

        ``paths`` are ``(N, 2)`` points of the world where teammates were.
        """
        walls = se2.apply(T_world_map, grid.centres(grid.is_occupied))
        if len(walls) == 0 or len(paths) == 0:
            return 0
        lone = walls[self._wall_m(walls) > _near_m(grid)]
        if len(lone) == 0:
            return 0
        return int(np.count_nonzero(cKDTree(paths).query(lone)[0] <= radius_m))


def overlap(a: OccupancyGrid, b: OccupancyGrid, T_world_a: Transform, T_world_b: Transform) -> float:
    """Return how much of the smaller map's known area the other knows too, 0..1."""
    if a.known_area_m2() < b.known_area_m2():
        a, b, T_world_a, T_world_b = b, a, T_world_b, T_world_a
    points = se2.apply(se2.between(T_world_a, T_world_b), b.centres(b.is_known))
    return float(np.mean(values_at(a, points) >= 0)) if len(points) else 0.0


def _near_m(grid: OccupancyGrid) -> float:
    return NEAR_WALL_CELLS * grid.resolution_m + 1e-6  # distances are float32, and this far is near


def _cells(grid: OccupancyGrid, points: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    cells = np.floor((points - np.asarray(grid.origin_m)) / grid.resolution_m).astype(np.int64)
    return cells[:, 0], cells[:, 1]


def field_at(grid: OccupancyGrid, field_m: NDArray[np.float32], points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return a field over the grid's cells at points ``(N, 2)``, inf outside."""
    col, row = _cells(grid, points)
    height, width = grid.shape
    inside = (row >= 0) & (row < height) & (col >= 0) & (col < width)
    values = np.full(len(points), np.inf)
    values[inside] = field_m[row[inside], col[inside]]
    return values


def values_at(grid: OccupancyGrid, points: NDArray[np.float64]) -> NDArray[np.int8]:
    """Return the grid's values at points ``(N, 2)``, -1 outside."""
    col, row = _cells(grid, points)
    height, width = grid.shape
    inside = (row >= 0) & (row < height) & (col >= 0) & (col < width)
    values = np.full(len(points), -1, dtype=np.int8)
    values[inside] = grid.cells[row[inside], col[inside]]
    return values
