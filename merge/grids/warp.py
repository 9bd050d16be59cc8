"""Bringing a map into another map's frame and lattice."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.grids.warp_kernels import warp_window
from mrslam.spatial import UNKNOWN, InputError, OccupancyGrid, se2

MAX_CELLS = 20_000 * 20_000
"""Larger grids are refused: 1 x 1 km at 5 cm, 400 MB."""
MARGIN_CELLS = 6
"""Cells around a square's place in the source that it may show: walls are drawn from there, and thin ones are told from
thick ones by their neighbours."""


def warp(grid: OccupancyGrid, T_target_grid: ArrayLike, resolution_m: float | None = None) -> OccupancyGrid:
    """Return the grid in the target's frame, on its lattice, cropped to what is known.

    A wall one cell thick stays one cell thick (two at steps) and unbroken at any angle, unknown stays unknown and
    free space keeps its extent. A coarser ``resolution_m`` keeps every wall, a finer one keeps its width in metres.
    """
    resolution_m = grid.resolution_m if resolution_m is None else float(resolution_m)
    T_target_grid = np.asarray(T_target_grid, dtype=np.float64)
    if T_target_grid.shape != (3,) or not np.isfinite(T_target_grid).all():
        raise InputError(f"T_target_grid must be three finite numbers, got {T_target_grid!r}")
    if not (math.isfinite(resolution_m) and resolution_m > 0):
        raise InputError(f"resolution_m must be > 0 m, got {resolution_m!r}")
    grid = grid.cropped()
    if grid.cells.size == 0:
        return OccupancyGrid(np.empty((0, 0), dtype=np.int8), resolution_m)
    row0, col0, height, width = _window(grid, T_target_grid, resolution_m)
    if height * width > MAX_CELLS:
        raise InputError(
            f"a map of {height} x {width} cells of {resolution_m} m is too large: use a coarser resolution"
        )
    out = np.empty((height, width), dtype=np.int8)
    inverse = to_source(grid.origin_m, grid.resolution_m, T_target_grid, resolution_m)
    warp_window(grid.cells, inverse, resolution_m / grid.resolution_m, row0, col0, out)
    return OccupancyGrid.at_cell(out, resolution_m, row0, col0).cropped()


def to_source(
    origin_m: tuple[float, float], source_m: float, T_target_grid: NDArray[np.float64], resolution_m: float
) -> NDArray[np.float64]:
    """Return the ``(2, 3)`` map from target points to source points, both in cells, x first.

    ``origin_m`` : corner of the source's cell (0, 0), metres; ``source_m``, ``resolution_m`` : edges of both's cells.
    """
    x, y, theta = T_target_grid
    cos, sin = _exact(math.cos(theta)), _exact(math.sin(theta))
    scale = resolution_m / source_m
    left, bottom = (-cos * x - sin * y - origin_m[0]), (sin * x - cos * y - origin_m[1])
    affine = [
        [cos * scale, sin * scale, left / source_m],
        [-sin * scale, cos * scale, bottom / source_m],
    ]
    # Rounding noise would decide between two cells where a point is on their border: lattice to lattice is thus exact.
    return np.array([[round(value, 9) for value in row] for row in affine])


def _exact(value: float) -> float:
    """Return quarter turns' sines and cosines without rounding noise."""
    return float(round(value)) if abs(value - round(value)) < 1e-12 else value


def _window(grid: OccupancyGrid, T_target_grid: NDArray[np.float64], resolution_m: float) -> tuple[int, int, int, int]:
    """Return (row0, col0, height, width) of the target lattice cells that the grid can reach."""
    height, width = grid.shape
    corners = np.array([[0, 0], [0, width], [height, 0], [height, width]], dtype=np.float64)[:, ::-1]
    points = se2.apply(T_target_grid, corners * grid.resolution_m + np.asarray(grid.origin_m)) / resolution_m
    low, high = np.floor(points.min(axis=0)).astype(int) - 1, np.ceil(points.max(axis=0)).astype(int) + 1
    return int(low[1]), int(low[0]), int(high[1] - low[1]), int(high[0] - low[0])


class Warp:
    """A map to be rewritten in the target's lattice square by square, as :func:`warp` does it (but for ties)."""

    def __init__(self, tiled: TiledGrid, T_target_grid: NDArray[np.float64], resolution_m: float) -> None:
        """Place the map at ``T_target_grid (3,)``, in cells of ``resolution_m``."""
        self._tiled, self._ratio = tiled, resolution_m / tiled.resolution_m
        self._to_source = to_source(tiled.offset_m, tiled.resolution_m, T_target_grid, resolution_m)
        steps = np.rint(self._to_source[:, 2])
        lattice = np.column_stack([np.eye(2), steps])
        self._shift = (int(steps[1]), int(steps[0])) if np.array_equal(self._to_source, lattice) else None
        """(row, col) from target to source cells where both lattices are one: cells are copied."""

    def square(self, row0: int, col0: int, edge: int) -> NDArray[np.int8]:
        """Return ``(edge, edge) int8`` from the target's lattice cell (row0, col0) on."""
        if self._shift is not None:
            return self._tiled.window(row0 + self._shift[0], col0 + self._shift[1], edge, edge)
        corners = np.array([[col0, row0], [col0 + edge, row0], [col0, row0 + edge], [col0 + edge, row0 + edge]])
        reached = corners @ self._to_source[:, :2].T + self._to_source[:, 2]
        col, row = (int(v) for v in np.floor(reached.min(axis=0)) - MARGIN_CELLS)
        width, height = (int(v) for v in np.ceil(reached.max(axis=0)) + MARGIN_CELLS - (col, row))
        inverse = self._to_source - np.array([[0.0, 0.0, col], [0.0, 0.0, row]])
        out = np.full((edge, edge), UNKNOWN, dtype=np.int8)
        source = self._tiled.window(row, col, height, width)
        if (source != UNKNOWN).any():
            warp_window(source, inverse, self._ratio, row0, col0, out)
        return out
