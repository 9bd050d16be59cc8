"""A map as tiles of cells: what is drawn and compared costs what is known, and again only what has changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import TILE_CELLS, UNKNOWN, OccupancyGrid, TiledMap
from mrslam.spatial.tiles import TileIndex, assembled, window

BLOCK_CELLS = 32
"""Edge of the blocks in which changes are told, cells."""
PER_TILE = TILE_CELLS // BLOCK_CELLS
NOTHING = np.full((TILE_CELLS, TILE_CELLS), UNKNOWN, dtype=np.int8)
"""A tile of which nothing is known."""

Tiles = Mapping[TileIndex, NDArray[np.int8]]
"""``(64, 64) int8`` by tile, not to be written to; those without a known cell are left out."""


class TileTable(NamedTuple):
    """Tiles as kernels take them, with a box of the lattice around them."""

    tile0: TileIndex
    """The first of the box."""
    pool: NDArray[np.int8]
    """``(N, 64, 64)`` the tiles."""
    slots: NDArray[np.int32]
    """``(I, J)`` of each tile of the box in the pool, -1 where nothing is known."""

    @classmethod
    def of(cls, tiles: Tiles, rim: int = 0) -> TileTable:
        """Return the table of tiles, its box wider than they are by ``rim`` tiles to every side."""
        if not tiles:
            return cls((0, 0), np.empty((0, *NOTHING.shape), dtype=np.int8), np.empty((0, 0), dtype=np.int32))
        indices = np.array(list(tiles))
        first, last = indices.min(axis=0) - rim, indices.max(axis=0) + rim
        slots = np.full(last - first + 1, -1, dtype=np.int32)
        slots[tuple((indices - first).T)] = np.arange(len(indices))
        return cls((int(first[0]), int(first[1])), np.stack(list(tiles.values())), slots)


@dataclass(frozen=True, eq=False)
class TiledGrid:
    """Tiles on a lattice that need not have a cell's corner at the frame's origin."""

    tiles: Tiles
    resolution_m: float
    offset_m: tuple[float, float] = (0.0, 0.0)
    """Lower left corner of lattice cell (0, 0), metres: less than a cell from the origin."""

    @classmethod
    def of(cls, known: OccupancyGrid | TiledMap) -> TiledGrid:
        """Return a map as tiles."""
        tiled = known if isinstance(known, TiledMap) else TiledMap.from_grid(known)
        tiles = {index: tile.cells for index, tile in tiled.tiles.items() if tile.known_cells}
        if isinstance(known, TiledMap):
            return cls(tiles, known.resolution_m)
        (x, y), (row0, col0), edge_m = known.origin_m, known.cell0, known.resolution_m
        return cls(tiles, edge_m, (x - col0 * edge_m, y - row0 * edge_m))

    @cached_property
    def grid(self) -> OccupancyGrid:
        """The same as one grid."""
        grid = assembled(self.tiles, self.resolution_m)
        origin_m = grid.origin_m[0] + self.offset_m[0], grid.origin_m[1] + self.offset_m[1]
        return OccupancyGrid(grid.cells, self.resolution_m, origin_m)

    def has_lattice_of(self, other: TiledGrid) -> bool:
        """Return whether tiles of one index lie on each other."""
        if self.resolution_m != other.resolution_m:
            return False
        shift = np.subtract(self.offset_m, other.offset_m) / self.resolution_m
        return bool(np.all(np.abs(shift) < 1e-6))

    def changed_blocks(self, before: TiledGrid | None) -> NDArray[np.int64]:
        """Return the lattice's blocks of 32 x 32 cells, (row, column) ``(N, 2)``, that differ from an earlier state.

        It has the same lattice; without one, those that are known.
        """
        old = {} if before is None else before.tiles
        indices = [index for index in self.tiles.keys() | old.keys() if self.tiles.get(index) is not old.get(index)]
        now, then = (
            np.array([tiles.get(index, NOTHING) for index in indices], dtype=np.int8).reshape(-1, *NOTHING.shape)
            for tiles in (self.tiles, old)
        )
        changed = np.argwhere(any_by_block(now != then))
        return np.array(indices, dtype=np.int64).reshape(-1, 2)[changed[:, 0]] * PER_TILE + changed[:, 1:]

    def points_m(self, cells: NDArray[np.int64]) -> NDArray[np.float64]:
        """Return the centres ``(N, 2)``, x and y in metres, of lattice cells ``(N, 2)``, (row, column)."""
        return (cells[:, ::-1] + 0.5) * self.resolution_m + np.asarray(self.offset_m)

    def values_at(self, points_m: NDArray[np.float64]) -> NDArray[np.int8]:
        """Return the cells' values ``(N,)`` at points ``(N, 2)``, metres; unknown outside of all tiles."""
        tile0, pool, slots = TileTable.of(self.tiles)
        cells = np.floor((points_m - np.asarray(self.offset_m)) / self.resolution_m).astype(np.int64)[:, ::-1]
        tile = cells // TILE_CELLS - tile0
        is_inside = ((tile >= 0) & (tile < slots.shape)).all(axis=1)
        slot = np.full(len(cells), -1, dtype=np.int64)
        slot[is_inside] = slots[tuple(tile[is_inside].T)]
        values = np.full(len(cells), UNKNOWN, dtype=np.int8)
        row, col = (cells % TILE_CELLS)[slot >= 0].T
        values[slot >= 0] = pool[slot[slot >= 0], row, col]
        return values

    def window(self, row0: int, col0: int, height: int, width: int) -> NDArray[np.int8]:
        """Return the cells ``(height, width)`` from lattice cell (row0, col0) on."""
        return window(self.tiles, row0, col0, height, width)


def any_by_block(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which blocks of tiles' cells ``(N, 64, 64)`` have one that is marked: ``(N, 2, 2)``."""
    by_rows = mask.reshape(-1, PER_TILE, BLOCK_CELLS, TILE_CELLS).any(axis=2)  # first along what lies side by side
    return np.asarray(by_rows.reshape(-1, PER_TILE, PER_TILE, BLOCK_CELLS).any(axis=3))
