"""A map made ready to be aligned: cropped, at the working resolution, with its walls as points with normals."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from alignment import kernels
from alignment.config import AlignmentConfig
from spatial import OccupancyGrid

REACH_M = 0.6
"""How far from a wall its nearest point is known, metres."""


@dataclass(frozen=True, eq=False)
class PreparedMap:
    """One map at the working resolution. Coordinates are metres in the map's own frame."""

    state: NDArray[np.uint8]
    """``(H, W)``: kernels.UNKNOWN, FREE, OCCUPIED, with an unknown border."""
    x0: float
    """Left edge of ``state``, metres."""
    y0: float
    """Lower edge of ``state``, metres."""
    res: float
    """Cell, metres."""

    @cached_property
    def _walls(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        cells, normals = kernels.wall_points(self.state)
        thin = -(-len(cells) // kernels.NOTHING)
        return (cells, normals) if thin <= 1 else (cells[::thin].copy(), normals[::thin].copy())

    @property
    def normals(self) -> NDArray[np.float64]:
        """``(N, 2)`` unit normals towards the free side; (0, 0) for specks."""
        return self._walls[1]

    @cached_property
    def points(self) -> NDArray[np.float64]:
        """``(N, 2)`` wall surface points, metres."""
        cells = self._walls[0]
        return np.stack([self.x0 + (cells[:, 1] + 0.5) * self.res, self.y0 + (cells[:, 0] + 0.5) * self.res], axis=-1)

    @cached_property
    def label(self) -> NDArray[np.uint16]:
        """``(4, H, W)`` per quadrant of facing the nearest wall point, see kernels.nearest_labels."""
        reach = min(max(2, round(REACH_M / self.res)), 15)
        return kernels.nearest_labels(self.state.shape[0], self.state.shape[1], self._walls[0], self._walls[1], reach)

    @property
    def wall_m(self) -> float:
        """Length of all walls, metres: cells of surface times the cell."""
        return len(self.points) * self.res

    @cached_property
    def known_m2(self) -> float:
        """Known area, square metres."""
        return float(np.count_nonzero(self.state)) * self.res**2

    @cached_property
    def centre(self) -> NDArray[np.float64]:
        """``(2,)`` mean of the wall points, metres."""
        return self.points.mean(axis=0) if len(self.points) else np.array([self.x0, self.y0])


def working_resolution(a: OccupancyGrid, b: OccupancyGrid, config: AlignmentConfig) -> float:
    """Return the cell both maps are brought to, metres: the coarser one's, doubled where too many."""
    res = max(a.resolution_m, b.resolution_m)
    if res < 0.8 * config.resolution_m:
        res = config.resolution_m
    for grid in (a, b):
        size = [n * grid.resolution_m for n in grid.shape]
        while math.prod(size) / res**2 > config.max_cells:
            res *= 2.0
    return res


def prepare(grid: OccupancyGrid, res: float) -> PreparedMap:
    """Bring a cropped grid to the cell ``res``: occupied where any source cell is, else free where any is."""
    border = max(kernels.REACH, round(REACH_M / res)) + 1
    height, width = grid.shape
    if abs(res - grid.resolution_m) < 1e-6 * res:
        state = np.zeros((height + 2 * border, width + 2 * border), dtype=np.uint8)
        inner = state[border : border + height, border : border + width]
        inner[grid.is_free] = kernels.FREE
        inner[grid.is_occupied] = kernels.OCCUPIED
    else:
        ratio = grid.resolution_m / res
        rows = np.floor((np.arange(height) + 0.5) * ratio).astype(np.int64) + border
        cols = np.floor((np.arange(width) + 0.5) * ratio).astype(np.int64) + border
        shape = (
            int(rows[-1]) + 1 + border if height else 2 * border,
            int(cols[-1]) + 1 + border if width else 2 * border,
        )
        state = np.zeros(shape, dtype=np.uint8)
        for mask, value in ((grid.is_free, kernels.FREE), (grid.is_occupied, kernels.OCCUPIED)):
            r, c = np.nonzero(mask)
            state[rows[r], cols[c]] = value
    x, y = grid.origin_m
    return PreparedMap(state, x - border * res, y - border * res, res)


def order_key(grid: OccupancyGrid) -> tuple[int, bytes]:
    """Return a key that depends on the cropped cells alone, so that align(a, b) and align(b, a) do the same work."""
    digest = hashlib.sha256(str(grid.shape).encode())
    digest.update(grid.cells.data)
    return int(np.count_nonzero(grid.is_known)), digest.digest()
