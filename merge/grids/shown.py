"""What some maps show together: near which cells of their lattice any of them has a wall, or free floor."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.grids.tiled_grid import Tiles
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, TILE_CELLS
from mrslam.spatial.tiles import TileIndex, window


class Shown:
    """Maps on one lattice; each of its tiles is looked at once, when it is asked for."""

    def __init__(self, maps: Sequence[Tiles], near_cells: int) -> None:
        """Look into these maps: what one of them has within ``near_cells`` of a cell, by row and column, it shows."""
        self._maps, self._near_cells = maps, near_cells
        self._near: dict[TileIndex, NDArray[np.bool_]] = {}

    def shows(self, cells: NDArray[np.int64], is_wall: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return of which cells ``(N, 2)`` (row, column) a map shows the same near them: a wall, or free ``(N,)``."""
        shown = np.zeros(len(cells), dtype=np.bool_)
        tiles, inside = np.divmod(cells, TILE_CELLS)
        kind = is_wall.astype(np.int64)
        for row, col in np.unique(tiles, axis=0).tolist():
            here = (tiles == (row, col)).all(axis=1)
            shown[here] = self._near_of((row, col))[kind[here], inside[here, 0], inside[here, 1]]
        return shown

    def _near_of(self, index: TileIndex) -> NDArray[np.bool_]:
        """Return ``(2, 64, 64)``: near which cells of a tile something is free, and near which there is a wall."""
        held = self._near.get(index)
        if held is None:
            rim = self._near_cells
            row, col, size = index[0] * TILE_CELLS - rim, index[1] * TILE_CELLS - rim, TILE_CELLS + 2 * rim
            has = np.zeros((2, size, size), dtype=np.bool_)
            around = [(index[0] + i, index[1] + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]
            for tiles in self._maps:
                if any(place in tiles for place in around):
                    cells = window(tiles, row, col, size, size)
                    has[0] |= (cells >= 0) & (cells <= FREE_MAX)
                    has[1] |= cells >= OCCUPIED_MIN
            steps = range(2 * rim + 1)
            by_row = np.logical_or.reduce([has[:, k : k + TILE_CELLS] for k in steps])
            held = self._near[index] = np.logical_or.reduce([by_row[:, :, k : k + TILE_CELLS] for k in steps])
        return held
