"""The map as a planner needs it: coarse cells, where the body fits, and what a step there costs."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray
from scipy import ndimage

from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.sim_driver.drivers.search import hang_together
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, OccupancyGrid
from mrslam.spatial.distance import euclidean

WALL_PENALTY = 4.0
"""How much dearer a step right beside a wall is."""
SPECK_MARGIN_M = 0.1
"""A robot in a map may be so much larger than its radius."""
UNKNOWN_PENALTY = 3.0
"""How much dearer a step is where nothing is known, if such steps are allowed: there may be a wall."""
ROOM_M2 = 0.25
"""Open cells that hang together over less are a pocket between obstacles, no place from which to plan."""
CROWD_PENALTY = 10.0
"""How much dearer a step through a teammate is: it may have gone by then."""


class Pooled(NamedTuple):
    """What the map has in its planning cells, ``(H, W)`` each; a cell may be none of the three."""

    occupied: NDArray[np.bool_]
    free: NDArray[np.bool_]
    unknown: NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Costmap:
    """Planning cells of one map."""

    weight: NDArray[np.float32]
    """``(H, W)``, cost of a step, >= 1; inf where the body does not fit or nothing is known."""
    pooled: Pooled
    room_m: float
    """Free cells that are farther than this from what is occupied have room to pass, metres."""
    resolution_m: float
    origin_m: tuple[float, float]

    @cached_property
    def is_frontier(self) -> NDArray[np.bool_]:
        """``(H, W)``, free cells beside unknown ones, with room to pass, as the map shows them."""
        occupied, free, unknown = self.pooled
        padded = np.pad(unknown, 1, constant_values=True)
        beside = padded[:-2, 1:-1] | padded[2:, 1:-1] | padded[1:-1, :-2] | padded[1:-1, 2:]
        return free & beside & (_gap_m(occupied, self.resolution_m, self.room_m) >= self.room_m)

    def cell(self, xy_m: NDArray[np.float64]) -> tuple[int, int]:
        """Return (row, col) of a point, moved inside the map."""
        col = int(np.floor((xy_m[0] - self.origin_m[0]) / self.resolution_m))
        row = int(np.floor((xy_m[1] - self.origin_m[1]) / self.resolution_m))
        height, width = self.weight.shape
        return min(max(row, 0), height - 1), min(max(col, 0), width - 1)

    def point(self, cells: NDArray[np.int32]) -> NDArray[np.float64]:
        """Return centres ``(..., 2)``, metres, of cells ``(..., 2)`` (row, col)."""
        return (np.asarray(cells)[..., ::-1] + 0.5) * self.resolution_m + np.asarray(self.origin_m)

    def inside(self, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the centre ``(2,)`` of the cell in the map that is nearest to a point."""
        return self.point(np.array(self.cell(xy_m), dtype=np.int32))

    def nearest_open(self, xy_m: NDArray[np.float64], within_m: float) -> tuple[int, int] | None:
        """Return the open cell nearest to a point, in a pocket only if all are; None where none is within reach."""
        row, col = self.cell(xy_m)
        reach = int(np.ceil(within_m / self.resolution_m))
        r0, c0 = max(row - reach, 0), max(col - reach, 0)
        rows, cols = np.nonzero(np.isfinite(self.weight[r0 : row + reach + 1, c0 : col + reach + 1]))
        centres = self.point(np.stack([rows + r0, cols + c0], axis=-1).astype(np.int32))
        gap = np.hypot(centres[:, 0] - xy_m[0], centres[:, 1] - xy_m[1])
        near = np.flatnonzero(gap <= within_m)
        cells = [(int(rows[k]) + r0, int(cols[k]) + c0) for k in near[np.argsort(gap[near], kind="stable")]]
        least = math.ceil(ROOM_M2 / self.resolution_m**2)
        return next((cell for cell in cells if hang_together(self.weight, *cell, least)), cells[0] if cells else None)


def make_costmap(
    grid: OccupancyGrid,
    config: DriverConfig,
    obstacles: NDArray[np.float64] | None = None,
    teammates: NDArray[np.float64] | None = None,
    hopeful: bool = False,
    through_unknown: bool = False,
) -> Costmap:
    """Return the planning cells of a map.

    ``obstacles`` : ``(N, 2)`` points seen now, in the map frame; ``teammates`` : ``(M, 2)`` where teammates are.
    ``hopeful`` : what is no larger than a robot is taken to be one that has driven on.
    ``through_unknown`` : paths may lead where nothing is known.
    """
    factor = coarseness(grid, config)
    pooled = Pooled(*pool(grid.cells, factor, FREE_MAX, OCCUPIED_MIN))
    occupied, free, unknown = pooled
    resolution = grid.resolution_m * factor
    height, width = occupied.shape
    body = config.robot_radius_m + config.margin_m
    if hopeful:
        specks = _specks(occupied, 2.0 * (config.robot_radius_m + SPECK_MARGIN_M) / resolution)
        occupied, free = occupied & ~specks, free | specks
    if obstacles is not None and len(obstacles):
        cols, rows = np.floor((obstacles - np.asarray(grid.origin_m)) / resolution).astype(np.int64).T
        inside = (rows >= 0) & (rows < height) & (cols >= 0) & (cols < width)
        occupied = occupied.copy()
        occupied[rows[inside], cols[inside]] = True
    gap_m = _gap_m(occupied, resolution, body + config.comfort_m)
    crowding = np.clip(1.0 - (gap_m - body) / config.comfort_m, 0.0, 1.0)
    weight = (1.0 + WALL_PENALTY * crowding**2).astype(np.float32)
    if through_unknown:
        weight[unknown] *= UNKNOWN_PENALTY
        free = free | unknown
    weight[~free | (gap_m < body)] = np.inf
    for x, y in teammates if teammates is not None else ():
        _add_disc(
            weight, (x - grid.origin_m[0]) / resolution, (y - grid.origin_m[1]) / resolution, 2.2 * body / resolution
        )
    return Costmap(weight, pooled, min(body, 0.15), resolution, grid.origin_m)


def coarseness(grid: OccupancyGrid, config: DriverConfig) -> int:
    """Return how many cells of a map go to a planning cell, each way."""
    factor = max(1, round(config.plan_resolution_m / grid.resolution_m))
    while grid.cells.size / factor**2 > config.max_plan_cells:
        factor += 1
    return factor


def _specks(occupied: NDArray[np.bool_], largest: float) -> NDArray[np.bool_]:
    """Return the groups of occupied cells that extend over at most so many cells."""
    labels, _ = ndimage.label(occupied, structure=np.ones((3, 3), dtype=np.int8))
    small = [
        max(rows.stop - rows.start, cols.stop - cols.start) <= largest for rows, cols in ndimage.find_objects(labels)
    ]
    return np.array([False, *small])[labels]


def _gap_m(occupied: NDArray[np.bool_], resolution_m: float, most_m: float) -> NDArray[np.float32]:
    """Return the room from each cell to the rim of the nearest occupied one, metres; far where above ``most_m``."""
    cells = euclidean(occupied, math.ceil(most_m / resolution_m) + 1.0)
    return np.maximum(cells - np.float32(0.5), 0.0) * np.float32(resolution_m)


def _add_disc(weight: NDArray[np.float32], col: float, row: float, radius: float) -> None:
    height, width = weight.shape
    r0, r1 = max(int(row - radius), 0), min(int(row + radius) + 2, height)
    c0, c1 = max(int(col - radius), 0), min(int(col + radius) + 2, width)
    if r0 < r1 and c0 < c1:
        rows, cols = np.ogrid[r0:r1, c0:c1]
        weight[r0:r1, c0:c1][(rows + 0.5 - row) ** 2 + (cols + 0.5 - col) ** 2 <= radius**2] += CROWD_PENALTY


@njit(cache=True, nogil=True)
def pool(
    cells: NDArray[np.int8], factor: int, free_max: int, occupied_min: int
) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:  # pragma: no cover - compiled
    """Return (occupied, free, unknown) of blocks of ``factor`` x ``factor`` cells.

    Occupied if any cell is, else free or unknown if half are; cells between free and occupied are none of the three.
    """
    rows, cols = cells.shape
    height, width = -(-rows // factor), -(-cols // factor)
    occupied = np.zeros((height, width), dtype=np.bool_)
    free = np.zeros((height, width), dtype=np.bool_)
    unknown = np.zeros((height, width), dtype=np.bool_)
    walls, count, unseen = np.zeros(cols, np.int16), np.zeros(cols, np.int16), np.zeros(cols, np.int16)
    for i in range(height):
        walls[:], count[:], unseen[:] = 0, 0, 0
        for r in range(i * factor, min((i + 1) * factor, rows)):  # along whole rows: eight cells at once
            for c in range(cols):
                value = cells[r, c]
                walls[c] += value >= occupied_min
                count[c] += (value >= 0) & (value <= free_max)
                unseen[c] += value < 0
        for j in range(width):
            in_walls, in_free, in_unknown = 0, 0, 0
            for c in range(j * factor, min((j + 1) * factor, cols)):
                in_walls, in_free, in_unknown = in_walls + walls[c], in_free + count[c], in_unknown + unseen[c]
            occupied[i, j] = in_walls > 0
            free[i, j] = in_walls == 0 and 2 * in_free >= factor * factor
            unknown[i, j] = in_walls == 0 and not free[i, j] and 2 * in_unknown >= factor * factor
    return occupied, free, unknown
