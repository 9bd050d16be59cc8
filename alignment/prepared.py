"""A map made ready to be aligned: cropped, at the working resolution, with its walls as points with normals."""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels import walls as wall_kernels
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, UNKNOWN, OccupancyGrid

DOTS = 3
"""Occupied cells no farther apart than this, rows or columns, are one thing."""
SPECK_M = 0.4
"""Occupied cells that reach no farther than this are people, legs and noise, metres."""
ISLAND_GAP_M, ISLAND_SHARE = 0.25, 0.2
"""Known cells farther apart belong to different parts, metres; parts below this share of the largest stay."""
REACH_M = 0.6
"""How far from a wall its nearest point is known, metres."""
STATE_OF_CELL = np.zeros(256, dtype=np.uint8)
"""wall_kernels' state by the byte of a cell."""
STATE_OF_CELL[: FREE_MAX + 1], STATE_OF_CELL[OCCUPIED_MIN:101] = wall_kernels.FREE, wall_kernels.OCCUPIED


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
        if len(cells) <= wall_kernels.NOTHING:
            return cells, normals
        # By cells: of a wall that is free on both sides, every second point would be the same side all along.
        cell = np.cumsum((np.diff(cells, axis=0, prepend=-1) != 0).any(axis=1))
        thin = -(-len(cells) // wall_kernels.NOTHING)
        while np.count_nonzero(kept := cell % thin == 0) > wall_kernels.NOTHING:
            thin += 1
        return cells[kept], normals[kept]

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
        rows, cols = np.divmod(np.flatnonzero(self.state == wall_kernels.OCCUPIED), self.state.shape[1])
        extent = wall_kernels.extents(rows, cols, DOTS, self._walls[0])  # far walls are dotted lines
        return np.asarray(extent * self.res > SPECK_M, dtype=np.bool_)

    @cached_property
    def wall_map(self) -> wall_kernels.WallMap:
        """All of it as kernels take it."""
        return wall_kernels.WallMap(
            self.state, self.label, self.points, self.normals, self.solid, self.x0, self.y0, self.res
        )

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
    """Bring a cropped grid to the cell ``res``, not finer than its own.

    A cell is occupied where any source cell is, else free where any is.
    """
    import cv2

    border = max(wall_kernels.REACH, round(REACH_M / res)) + 1
    found = grid.cells.view(np.uint8)
    if found.size:
        found = np.asarray(cv2.LUT(found, STATE_OF_CELL), dtype=np.uint8)
    if abs(res - grid.resolution_m) >= 1e-6 * res:
        ratio = grid.resolution_m / res
        for axis in (0, 1):
            found = _highest(found, np.floor((np.arange(grid.shape[axis]) + 0.5) * ratio), axis)
    state = np.pad(found, border)
    x, y = grid.origin_m
    return PreparedMap(state, x - border * res, y - border * res, res)


def _highest(state: NDArray[np.uint8], to: NDArray[np.float64], axis: int) -> NDArray[np.uint8]:
    """Return the highest state (occupied, free, unknown) of each run of equal ``to`` along an axis."""
    first = np.flatnonzero(np.diff(to, prepend=-1.0))
    last = np.append(first[1:], len(to)) - 1
    out = state.take(first, axis=axis)
    for k in range(1, int(np.max(last - first, initial=0)) + 1):
        np.maximum(out, state.take(np.minimum(first + k, last), axis=axis), out=out)
    return out


def main_part(grid: OccupancyGrid) -> OccupancyGrid:
    """Return the map without the large parts that nothing known joins to its largest one.

    A mapper that loses itself begins anew elsewhere, and shows one place twice; only within a part can it be trusted.
    """
    import cv2

    if grid.cells.size == 0:
        return grid
    block = max(1, round(ISLAND_GAP_M / grid.resolution_m))
    strips = grid.cells[::block].copy()
    for k in range(1, block):
        part = grid.cells[k::block]
        np.maximum(strips[: len(part)], part, out=strips[: len(part)])
    blocks = strips[:, ::block].copy()
    for k in range(1, block):
        part = strips[:, k::block]
        np.maximum(blocks[:, : part.shape[1]], part, out=blocks[:, : part.shape[1]])
    count, label, stats, _ = cv2.connectedComponentsWithStats(
        np.asarray(blocks != UNKNOWN, dtype=np.uint8), connectivity=8, ltype=cv2.CV_32S
    )
    sizes = stats[1:, cv2.CC_STAT_AREA]
    if count <= 2 or np.sort(sizes)[-2] < ISLAND_SHARE * sizes.max():
        return grid
    inside = np.repeat(np.repeat(label == 1 + int(np.argmax(sizes)), block, axis=0), block, axis=1)
    kept = np.where(inside[: grid.shape[0], : grid.shape[1]], grid.cells, np.int8(UNKNOWN))
    return OccupancyGrid(kept, grid.resolution_m, grid.origin_m).cropped()


def is_smaller(one: OccupancyGrid, two: OccupancyGrid) -> bool:
    """Return an order by the cropped cells and their edge alone, so that align(a, b) and (b, a) do the same work."""
    sizes = [grid.known_area_m2() for grid in (one, two)]
    return sizes[0] < sizes[1] if sizes[0] != sizes[1] else _digest(one) < _digest(two)


def _digest(grid: OccupancyGrid) -> bytes:
    digest = hashlib.sha256(f"{grid.shape} {grid.resolution_m}".encode())
    digest.update(grid.cells.data)
    return digest.digest()
