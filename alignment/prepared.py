"""A map made ready to be aligned: cropped, at the working resolution, with its walls as points with normals."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property

import cv2
import numpy as np
from numpy.typing import NDArray

from alignment import wall_kernels
from alignment.config import AlignmentConfig
from spatial import UNKNOWN, OccupancyGrid

SPECK_M = 0.4
"""Occupied cells that reach no farther than this are people, legs and noise, metres."""
ISLAND_GAP_M, ISLAND_SHARE = 0.25, 0.2
"""Known cells farther apart belong to different parts, metres; parts below this share of the largest stay."""
STRIPE = 256
"""Rows resampled at once."""
REACH_M = 0.6
"""How far from a wall its nearest point is known, metres."""


@dataclass(frozen=True, eq=False)
class PreparedMap:
    """One map at the working resolution. Coordinates are metres in the map's own frame."""

    state: NDArray[np.uint8]
    """``(H, W)``: wall_kernels.UNKNOWN, FREE, OCCUPIED, with an unknown border."""
    x0: float
    """Left edge of ``state``, metres."""
    y0: float
    """Lower edge of ``state``, metres."""
    res: float
    """Cell, metres."""

    @cached_property
    def _walls(self) -> tuple[NDArray[np.int32], NDArray[np.float64]]:
        cells, normals = wall_kernels.wall_points(self.state)
        thin = -(-len(cells) // wall_kernels.NOTHING)
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
        """``(4, H, W)`` per quadrant of facing the nearest wall point, see wall_kernels.nearest_labels."""
        reach = min(max(2, round(REACH_M / self.res)), 15)
        return wall_kernels.nearest_labels(
            self.state.shape[0], self.state.shape[1], self._walls[0], self._walls[1], reach
        )

    @cached_property
    def solid(self) -> NDArray[np.bool_]:
        """``(N,)``: whether each point is part of something larger than ``SPECK_M``, which does not come and go."""
        occupied = (self.state == wall_kernels.OCCUPIED).astype(np.uint8)
        joined = cv2.dilate(occupied, np.ones((3, 3), dtype=np.uint8))  # far walls are dotted lines
        _, label, stats, _ = cv2.connectedComponentsWithStats(joined, connectivity=8, ltype=cv2.CV_32S)
        large = (np.maximum(stats[:, cv2.CC_STAT_WIDTH], stats[:, cv2.CC_STAT_HEIGHT]) - 2) * self.res > SPECK_M
        cells = self._walls[0]
        return np.asarray(large[label[cells[:, 0], cells[:, 1]]], dtype=np.bool_)

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
    border = max(wall_kernels.REACH, round(REACH_M / res)) + 1
    height, width = grid.shape
    if abs(res - grid.resolution_m) < 1e-6 * res:
        state = np.zeros((height + 2 * border, width + 2 * border), dtype=np.uint8)
        inner = state[border : border + height, border : border + width]
        inner[grid.is_free] = wall_kernels.FREE
        inner[grid.is_occupied] = wall_kernels.OCCUPIED
    else:
        ratio = grid.resolution_m / res
        rows = np.floor((np.arange(height) + 0.5) * ratio).astype(np.int64) + border
        cols = np.floor((np.arange(width) + 0.5) * ratio).astype(np.int64) + border
        shape = (
            int(rows[-1]) + 1 + border if height else 2 * border,
            int(cols[-1]) + 1 + border if width else 2 * border,
        )
        state = np.zeros(shape, dtype=np.uint8)
        for mask, value in ((grid.is_free, wall_kernels.FREE), (grid.is_occupied, wall_kernels.OCCUPIED)):
            for top in range(0, height, STRIPE):  # bounds the memory of the indices
                at = np.nonzero(mask[top : top + STRIPE])
                state[rows[top + at[0]], cols[at[1]]] = value
    x, y = grid.origin_m
    return PreparedMap(state, x - border * res, y - border * res, res)


def main_part(grid: OccupancyGrid) -> OccupancyGrid:
    """Return the map without the large parts that nothing known joins to its largest one.

    A mapper that loses itself begins anew elsewhere, and shows one place twice; only within a part can it be trusted.
    """
    if grid.cells.size == 0:
        return grid
    block = max(1, round(ISLAND_GAP_M / grid.resolution_m))
    rows, cols = (-(-n // block) * block for n in grid.shape)
    known = np.zeros((rows, cols), dtype=np.bool_)
    known[: grid.shape[0], : grid.shape[1]] = grid.is_known
    blocks = known.reshape(rows // block, block, cols // block, block).any(axis=(1, 3))
    count, label, stats, _ = cv2.connectedComponentsWithStats(
        np.asarray(blocks, dtype=np.uint8), connectivity=8, ltype=cv2.CV_32S
    )
    sizes = stats[1:, cv2.CC_STAT_AREA]
    if count <= 2 or np.sort(sizes)[-2] < ISLAND_SHARE * sizes.max():
        return grid
    inside = np.repeat(np.repeat(label == 1 + int(np.argmax(sizes)), block, axis=0), block, axis=1)
    kept = np.where(inside[: grid.shape[0], : grid.shape[1]], grid.cells, np.int8(UNKNOWN))
    return OccupancyGrid(kept, grid.resolution_m, grid.origin_m).cropped()


def order_key(grid: OccupancyGrid) -> tuple[int, bytes]:
    """Return a key that depends on the cropped cells alone, so that align(a, b) and align(b, a) do the same work."""
    digest = hashlib.sha256(str(grid.shape).encode())
    digest.update(grid.cells.data)
    return int(np.count_nonzero(grid.is_known)), digest.digest()
