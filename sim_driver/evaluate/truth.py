"""Maps and transforms against the world that they are of."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from mrslam.spatial import UNKNOWN, OccupancyGrid, se2
from mrslam.spatial.distance import euclidean
from mrslam.spatial.se2 import Transform

FALSE_MERGE_M, FALSE_MERGE_DEG = 0.5, 5.0
"""An accepted transform farther off than this is a false merge, metres and degrees: half a door's width and more."""
MUST_MERGE = 0.3
"""Pairs of maps that share at least this part of the smaller one should be merged, 0..1: the method
``auto`` finds all such pairs in the first table of docs/alignment.md."""
NEAR_WALL_CELLS = 2.0
"""A wall cell of a map is right within this distance of a true wall, cells of the map: one for each map's rounding."""
BLOCK_POINTS = 1 << 16
"""Points of a map that another one is asked for at once."""
MARGIN_M = 1.0
"""Distances to walls are known up to this far outside of a world, metres; beyond, a wall counts as wrong anyway."""


def is_false_merge(off_m: float, off_deg: float) -> bool:
    """Return whether a transform so far off is of a wrong merge, not only of an inaccurate one."""
    return off_m > FALSE_MERGE_M or off_deg > FALSE_MERGE_DEG


def pair_error(
    T_a_b: Transform, T_world_a: Transform, T_world_b: Transform, point: NDArray[np.float64] | None = None
) -> tuple[float, float]:
    """Return how far ``T_a_b`` is from the truth: metres at a ``point (2,)`` of b, its origin if None, and degrees."""
    T_point = np.zeros(3) if point is None else np.array([*point, 0.0])
    true = se2.compose(se2.between(T_world_a, T_world_b), T_point)
    distance_m, angle_rad = se2.difference(se2.compose(T_a_b, T_point), true)
    return distance_m, float(np.degrees(angle_rad))


@dataclass(frozen=True, eq=False)
class Judge:
    """A world to hold maps against."""

    world: OccupancyGrid
    reachable: NDArray[np.bool_]
    """``(H, W)`` the floor that counts."""

    @cached_property
    def _floor(self) -> NDArray[np.float64]:
        """``(N, 2)``: centres of the cells that count, of which every map of a team is asked."""
        return self.world.centres(self.reachable)

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
        values = values_from(grid, se2.inverse(T_world_map), self._floor)
        return float(np.mean(values == 0)) if len(values) else 0.0

    def occupied_precision(
        self, grid: OccupancyGrid, T_world_map: Transform, unsure_m: float = 0.0, or_at: Sequence[Transform] = ()
    ) -> float:
        """Return the share of the map's walls within two cells and ``unsure_m`` of a true wall; 1 where it has none.

        ``or_at`` : other frames of the map in which a wall may be true as well.
        """
        wall_m = self._walls_m(grid, (T_world_map, *or_at))
        return float(np.mean(wall_m <= _near_m(grid) + unsure_m)) if len(wall_m) else 1.0

    def _walls_m(self, grid: OccupancyGrid, frames: Sequence[Transform]) -> NDArray[np.float64]:
        """Return how far each wall cell of a map is from the nearest true wall in any of its frames, metres."""
        walls = grid.centres(grid.is_occupied)
        return np.min([self._wall_m(se2.apply(T_world_map, walls)) for T_world_map in frames], axis=0)

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
        is_shown = values_from(to[0], se2.inverse(to[1]), walls) == 0
        return float(np.count_nonzero(is_floor & is_shown)) * shown[0].resolution_m

    def ghosts(
        self,
        grid: OccupancyGrid,
        T_world_map: Transform,
        paths: NDArray[np.float64],
        radius_m: float,
        or_at: Sequence[Transform] = (),
    ) -> int:
        """Return how many wall cells of the map stand where teammates drove, away from true walls.

        ``paths`` are ``(N, 2)`` points of the world where teammates were. ``or_at`` : see :meth:`occupied_precision`.
        """
        walls = se2.apply(T_world_map, grid.centres(grid.is_occupied))
        if len(walls) == 0 or len(paths) == 0:
            return 0
        lone = walls[self._walls_m(grid, (T_world_map, *or_at)) > _near_m(grid)]
        if len(lone) == 0:
            return 0
        return int(np.count_nonzero(cKDTree(paths).query(lone)[0] <= radius_m))


def overlap(a: OccupancyGrid, b: OccupancyGrid, T_world_a: Transform, T_world_b: Transform) -> float:
    """Return how much of the smaller map's known area the other knows too, 0..1."""
    if a.known_area_m2() < b.known_area_m2():
        a, b, T_world_a, T_world_b = b, a, T_world_b, T_world_a
    values = values_from(a, se2.between(T_world_a, T_world_b), b.centres(b.is_known))
    return float(np.mean(values >= 0)) if len(values) else 0.0


def shared_middle(
    a: OccupancyGrid, b: OccupancyGrid, T_world_a: Transform, T_world_b: Transform
) -> NDArray[np.float64]:
    """Return the middle ``(2,)`` of what both maps know, in map b's frame; of what b knows where they share nothing."""
    points = b.centres(b.is_known)
    is_shared = values_from(a, se2.between(T_world_a, T_world_b), points) >= 0
    points = points[is_shared] if is_shared.any() else points
    return np.asarray(points.mean(axis=0)) if len(points) else np.zeros(2)


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


def values_from(grid: OccupancyGrid, T_grid_frame: Transform, points: NDArray[np.float64]) -> NDArray[np.int8]:
    """Return the grid's values at points ``(N, 2)`` of another frame, -1 outside.

    Block by block: a campus has millions of points, and each takes a hundred bytes on its way.
    """
    values = np.empty(len(points), dtype=np.int8)
    for first in range(0, len(points), BLOCK_POINTS):
        block = slice(first, first + BLOCK_POINTS)
        values[block] = values_at(grid, se2.apply(T_grid_frame, points[block]))
    return values
