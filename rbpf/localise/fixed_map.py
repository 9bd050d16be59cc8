"""A saved map as scans are matched to it: made once from its grid, whoever drew that, and never changed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.localise.surfaces import fill_free, fill_walls, find_surfaces
from mrslam.spatial import InputError, OccupancyGrid
from mrslam.spatial.grid import FREE_MAX, OCCUPIED_MIN
from mrslam.spatial.hits.cells import TILE, TILE_WORDS
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.se2 import Transform

REACH_M = 0.25
"""Wall this far to either side shapes a surface, metres: as far as the normal of a scan's point looks (0.22 m)."""
NEAR_M = 0.15
"""A wall's edge faces what is free within this distance: maps leave a cell or two before walls unknown, for beams stop
clearing 0.1 m before what they hit."""
SPARE = 2
"""Empty tiles around a map: the window's outermost count as unknown, and beams end beyond."""


class FixedMap:
    """Stands where a rolling map does; nothing that is seen enters it."""

    is_empty = False

    def __init__(self, grid: OccupancyGrid, resolution_m: float) -> None:
        """Make it of a grid, in whose frame it is, with cells of ``resolution_m``.

        Raises ``InputError`` where the grid shows no wall.
        """
        if not grid.is_occupied.any():
            raise InputError("a map without walls shows nobody where he is")
        self.resolution_m = resolution_m
        edge, origin = TILE * resolution_m, np.array(grid.origin_m, dtype=np.float64)
        size_m = np.array(grid.shape[::-1]) * grid.resolution_m
        first = np.floor(origin / edge).astype(np.int64) - SPARE
        tiles = np.floor((origin + size_m) / edge).astype(np.int64) + 1 + SPARE - first
        low = first * TILE
        words = np.zeros((tiles[1] * TILE, tiles[0] * TILE), dtype=np.uint32)
        fill_free(grid.cells, origin, grid.resolution_m, FREE_MAX, low, resolution_m, words)
        fill_walls(surfaces_m(grid, resolution_m), low, resolution_m, words)
        self._tiles = _tiled(words, int(first[1]), int(first[0]), resolution_m)

    def tiles_around(self, T_map_base: Transform) -> Tiles:
        """Return the map, which is all of it wherever the robot is."""
        return self._tiles

    def is_due(self, T_map_base: Transform) -> bool:
        """Return that no scan is to be added."""
        return False

    def add(self, T_map_base: Transform, points: NDArray[np.float64]) -> None:
        """Leave the map as it is."""

    def clear(self) -> None:
        """Leave the map as it is."""

    def state(self) -> dict[str, Any]:
        """Return nothing: the map is made of its file again."""
        return {}

    def restore(self, state: dict[str, Any]) -> None:
        """Leave the map as it is."""


def surfaces_m(grid: OccupancyGrid, resolution_m: float) -> NDArray[np.float64]:
    """Return the surfaces ``(N, 5)`` of a grid's walls: (x, y) and the unit normal, map frame, metres, and 1 or 0.

    The last says whether the normal points to the one free side. Coarse cells become several surfaces, along the wall.
    """
    found = np.empty((int(grid.is_occupied.sum()), 5))
    reach = max(math.ceil(REACH_M / grid.resolution_m), 1)
    near = max(round(NEAR_M / grid.resolution_m), 1)
    surfaces = found[: find_surfaces(grid.cells, FREE_MAX, OCCUPIED_MIN, reach, near, found)]
    surfaces[:, :2] = surfaces[:, :2] * grid.resolution_m + np.array(grid.origin_m)
    pieces = math.ceil(grid.resolution_m / resolution_m - 1e-6)
    if pieces > 1:
        along_m = grid.resolution_m * ((np.arange(pieces) + 0.5) / pieces - 0.5)
        surfaces = np.repeat(surfaces, pieces, axis=0)
        shift = np.tile(along_m, len(surfaces) // pieces)[:, None]
        surfaces[:, :2] += shift * np.stack([-surfaces[:, 3], surfaces[:, 2]], axis=-1)
    return surfaces


def _tiled(words: NDArray[np.uint32], row0: int, col0: int, resolution_m: float) -> Tiles:
    """Return cells ``(32 rows, 32 cols) uint32`` as tiles, of which those without content are one."""
    rows, cols = words.shape[0] // TILE, words.shape[1] // TILE
    blocks = words.reshape(rows, TILE, cols, TILE).swapaxes(1, 2).reshape(rows * cols, TILE_WORDS)
    has_content = blocks.any(axis=1)
    pool = np.concatenate([np.zeros((1, TILE_WORDS), dtype=np.uint32), blocks[has_content]])
    table = np.zeros(rows * cols, dtype=np.int32)
    table[has_content] = np.arange(1, len(pool), dtype=np.int32)
    return Tiles(pool, table.reshape(rows, cols), row0, col0, resolution_m)
