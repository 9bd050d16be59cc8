"""What some maps show together: near which cells of their lattice how many of them have a wall, or free floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.grids.tiled_grid import Tiles
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, TILE_CELLS
from mrslam.spatial.tiles import TileIndex, distinct, window


class Shown:
    """Maps on one lattice; each of its tiles is looked at once, when it is asked for."""

    def __init__(self, maps: Sequence[Tiles], near_cells: int) -> None:
        """Look into these maps: what one of them has within ``near_cells`` of a cell, by row and column, it shows."""
        self._maps, self._near_cells = maps, near_cells
        self._near: dict[TileIndex, NDArray[np.int16]] = {}

    def count(self, cells: NDArray[np.int64], is_wall: NDArray[np.bool_]) -> NDArray[np.int16]:
        """Return ``(N,)`` how many maps show the same near cells ``(N, 2)`` (row, column): a wall, or free ``(N,)``."""
        tiles, inside = np.divmod(cells, TILE_CELLS)
        first, which = distinct(tiles)
        near = np.array([self._near_of((row, col)) for row, col in tiles[first].tolist()], dtype=np.int16)
        near = near.reshape(-1, 2, TILE_CELLS, TILE_CELLS)
        return near[which, is_wall.astype(np.int64), inside[:, 0], inside[:, 1]]

    def _near_of(self, index: TileIndex) -> NDArray[np.int16]:
        """Return ``(2, 64, 64)``: how many maps have something free near each cell of a tile, and how many a wall."""
        held = self._near.get(index)
        if held is None:
            rim = self._near_cells
            row, col, size = index[0] * TILE_CELLS - rim, index[1] * TILE_CELLS - rim, TILE_CELLS + 2 * rim
            steps, held = range(2 * rim + 1), np.zeros((2, TILE_CELLS, TILE_CELLS), dtype=np.int16)
            for tiles in self._maps:
                if any((index[0] + i, index[1] + j) in tiles for i in (-1, 0, 1) for j in (-1, 0, 1)):
                    cells = window(tiles, row, col, size, size)
                    has = np.stack([(cells >= 0) & (cells <= FREE_MAX), cells >= OCCUPIED_MIN])
                    by_row = np.logical_or.reduce([has[:, k : k + TILE_CELLS] for k in steps])
                    held += np.logical_or.reduce([by_row[:, :, k : k + TILE_CELLS] for k in steps])
            self._near[index] = held
        return held
