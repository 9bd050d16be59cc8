"""A world: the true floor plan that simulated robots drive in and that results are compared with."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mrslam.spatial import InputError, OccupancyGrid, se2
from mrslam.spatial.distance import euclidean
from mrslam.spatial.se2 import Transform

WALL = 100


@dataclass(frozen=True, eq=False)
class World:
    """A closed floor plan: every cell is free (0) or wall (100), and the outermost ring is wall.

    Raises ``InputError`` where no free cell is left.
    """

    name: str
    grid: OccupancyGrid
    """The truth in the world frame."""

    def __post_init__(self) -> None:
        cells = np.where(self.grid.cells == 0, 0, WALL).astype(np.int8)
        if cells.size:
            cells[[0, -1], :] = WALL
            cells[:, [0, -1]] = WALL
        if not (cells == 0).any():
            raise InputError(f"world {self.name}: no free cell; dark pixels are walls, light ones are floor")
        cells.flags.writeable = False
        object.__setattr__(self, "grid", OccupancyGrid(cells, self.grid.resolution_m, self.grid.origin_m))

    @property
    def resolution_m(self) -> float:
        """Edge of a cell, metres."""
        return self.grid.resolution_m

    @property
    def size_m(self) -> tuple[float, float]:
        """Extent in x and y, metres."""
        height, width = self.grid.shape
        return width * self.resolution_m, height * self.resolution_m

    @cached_property
    def is_wall(self) -> NDArray[np.bool_]:
        """``(H, W)``."""
        return np.ascontiguousarray(self.grid.cells != 0)

    @cached_property
    def clearance_cells(self) -> NDArray[np.float32]:
        """``(H, W)`` distance from every cell's centre to the nearest wall cell's centre, in cells."""
        return euclidean(self.is_wall)

    @cached_property
    def _floors(self) -> NDArray[np.int32]:
        """``(H, W)``: the number of the connected free region of each cell, from 1 on; 0 in walls."""
        return np.asarray(ndimage.label(~self.is_wall)[0], dtype=np.int32)

    def is_joined(self, one_m: NDArray[np.float64], other_m: NDArray[np.float64]) -> bool:
        """Return whether free cells lead from one point ``(2,)`` of the floor to another, metres."""
        a, b = (self._floors[self._cell(xy_m)] for xy_m in (one_m, other_m))
        return bool(a == b)

    @cached_property
    def reachable(self) -> NDArray[np.bool_]:
        """``(H, W)`` the floor that missions are about.

        The largest connected free region that does not touch the border, or the largest of all where each does (a plan
        that is open to the outside).
        """
        labels = self._floors
        area = np.bincount(labels.ravel())
        area[0] = 0
        ring = np.concatenate([labels[1], labels[-2], labels[:, 1], labels[:, -2]])
        inside = area.copy()
        inside[np.unique(ring)] = 0
        inside = inside if inside.max() > 0.02 * area.max() else area
        return labels == int(np.argmax(inside))

    def clearance_m(self, xy_m: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the distance from points ``(..., 2)`` to the nearest wall cell's near edge, metres, to half a cell."""
        row, col = self._cell(xy_m)
        height, width = self.grid.shape
        inside = (row >= 0) & (row < height) & (col >= 0) & (col < width)
        cells = self.clearance_cells[np.clip(row, 0, height - 1), np.clip(col, 0, width - 1)]
        return np.where(inside, np.maximum(cells - 0.5, 0.0) * self.resolution_m, 0.0)

    def free_start(
        self, rng: np.random.Generator, clearance_m: float = 0.3, apart_from: NDArray[np.float64] | None = None
    ) -> Transform:
        """Return a random pose ``T_world_base`` on the reachable floor, at least ``clearance_m`` from walls.

        ``apart_from`` : ``(N, 2)`` points to keep twice that far from. Raises ``InputError`` where no cell qualifies.
        """
        is_free = self.reachable & (self.clearance_cells >= clearance_m / self.resolution_m + 1.0)
        for taken in () if apart_from is None else np.asarray(apart_from):
            row, col = (int(one) for one in self._cell(taken))
            reach = int(2.0 * clearance_m / self.resolution_m) + 2
            top, left = max(row - reach, 0), max(col - reach, 0)
            part = is_free[top : max(row + reach + 1, 0), left : max(col + reach + 1, 0)]
            rows, cols = np.nonzero(part)
            part[rows, cols] = (
                np.linalg.norm(self._centre(rows + top, cols + left) - taken, axis=-1) >= 2.0 * clearance_m
            )
        candidates = np.flatnonzero(is_free)
        if len(candidates) == 0:
            raise InputError(f"world {self.name}: no free place {clearance_m:g} m from every wall and robot")
        x, y = self._centre(*divmod(candidates[rng.integers(len(candidates))], is_free.shape[1]))
        return se2.transform(x, y, rng.uniform(-np.pi, np.pi))

    def _cell(self, xy_m: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return row and column of points ``(..., 2)``, metres."""
        col, row = np.moveaxis(np.floor((xy_m - np.asarray(self.grid.origin_m)) / self.resolution_m).astype(int), -1, 0)
        return row, col

    def _centre(self, rows: NDArray[np.int64], cols: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the centres ``(..., 2)`` of cells, metres."""
        return (np.stack([cols, rows], axis=-1) + 0.5) * self.resolution_m + np.asarray(self.grid.origin_m)
