"""Maps as tiles with revisions: what a mapper publishes and robots exchange.

A tile is a fixed square of the map's lattice, 64 x 64 cells of occupancy; the tiles of ``mrslam.spatial.hits``, of 32 x
32 cells that count hits, are another thing. Its revision is the map's revision when its content last changed, so
"what do you have after revision n" is answered by comparing numbers.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.errors import InputError
from mrslam.spatial.grid import UNKNOWN, OccupancyGrid
from mrslam.spatial.key_scans import KeyScans

TILE_CELLS = 64
"""Edge of a tile, cells."""

MOST_CELLS = 1 << 28
"""No map's bounding box is larger: 800 x 800 m at 5 cm."""

TileIndex = tuple[int, int]
"""(row, col) of a tile: it holds lattice rows ``64 * row ..  64 * row + 63``, and columns likewise."""


@dataclass(frozen=True, eq=False)
class Tile:
    """One square of a map."""

    revision: int
    """Map revision at which ``cells`` last changed."""
    cells: NDArray[np.int8]
    """``(64, 64) int8``, -1 or 0..100; not to be written to."""

    @cached_property
    def known_cells(self) -> int:
        """Number of cells that are known."""
        return int(np.count_nonzero(self.cells != UNKNOWN))


def distinct(places: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return rows that hold the distinct ones of places ``(N, 2)``, and ``(N,)`` which of these each place is.

    ``places`` : (row, column) within +-2^31, as of a lattice's squares. Many times faster than ``np.unique`` is
    with rows.
    """
    _, first, which = np.unique((places[:, 0] << 32) + places[:, 1], return_index=True, return_inverse=True)
    return first, which


def box_cells(indices: Collection[TileIndex]) -> int:
    """Return how many cells the smallest grid has that holds these tiles."""
    rows, cols = zip(*indices, strict=True) if indices else ((0,), (0,))
    return (max(rows) - min(rows) + 1) * (max(cols) - min(cols) + 1) * TILE_CELLS**2


def assembled(tiles: Mapping[TileIndex, NDArray[np.int8]], resolution_m: float) -> OccupancyGrid:
    """Return the known part of tiles ``(64, 64)`` as one grid, its origin on the lattice; 0 x 0 where nothing is."""
    row0, col0, row1, col1 = known_box(tiles)
    cells = np.full((row1 - row0, col1 - col0), UNKNOWN, dtype=np.int8)
    for (i, j), tile in tiles.items():
        r, c = i * TILE_CELLS - row0, j * TILE_CELLS - col0
        part = cells[max(r, 0) : max(r + TILE_CELLS, 0), max(c, 0) : max(c + TILE_CELLS, 0)]
        part[...] = tile[max(-r, 0) :, max(-c, 0) :][: part.shape[0], : part.shape[1]]
    return OccupancyGrid.at_cell(cells, resolution_m, row0, col0)


def window(
    tiles: Mapping[TileIndex, NDArray[np.int8]], row0: int, col0: int, height: int, width: int
) -> NDArray[np.int8]:
    """Return the cells ``(height, width)`` of tiles ``(64, 64)`` from lattice cell (row0, col0) on."""
    out = np.full((height, width), UNKNOWN, dtype=np.int8)
    for i in range(row0 // TILE_CELLS, -(-(row0 + height) // TILE_CELLS)):
        for j in range(col0 // TILE_CELLS, -(-(col0 + width) // TILE_CELLS)):
            if (tile := tiles.get((i, j))) is not None:
                r, c = i * TILE_CELLS - row0, j * TILE_CELLS - col0
                part = tile[max(-r, 0) : height - r, max(-c, 0) : width - c]
                r, c = max(r, 0), max(c, 0)
                out[r : r + part.shape[0], c : c + part.shape[1]] = part
    return out


def known_box(tiles: Mapping[TileIndex, NDArray[np.int8]]) -> tuple[int, int, int, int]:
    """Return the lattice (row0, col0, row1, col1) of the least box that holds every known cell, ends excluded.

    Of tiles ``(64, 64)`` those at the edges are looked at; only where nothing is known in them the next ones are.
    """
    (row0, row1), (col0, col1) = (_known_ends(tiles, axis) for axis in (0, 1))
    return row0, col0, row1, col1


def _known_ends(tiles: Mapping[TileIndex, NDArray[np.int8]], axis: int) -> tuple[int, int]:
    """Return the first lattice row (axis 0) or column (1) with a known cell, and the one after the last."""
    by_line: dict[int, list[NDArray[np.int8]]] = {}
    for index, tile in tiles.items():
        by_line.setdefault(index[axis], []).append(tile)

    def known(line: int) -> NDArray[np.int64]:
        return np.flatnonzero(np.max([tile.max(axis=1 - axis) for tile in by_line[line]], axis=0) > UNKNOWN)

    lines = sorted(by_line)
    first = next((line * TILE_CELLS + int(k[0]) for line in lines if (k := known(line)).size), 0)
    last = next((line * TILE_CELLS + int(k[-1]) + 1 for line in reversed(lines) if (k := known(line)).size), 0)
    return first, last


@dataclass(frozen=True, eq=False)
class TiledMap:
    """An occupancy map without bounds."""

    resolution_m: float
    tiles: Mapping[TileIndex, Tile] = field(default_factory=dict)
    revision: int = 0
    """Grows with every change; no tile's revision is above it."""

    def known_area_m2(self) -> float:
        """Return the area of known cells, square metres; tiles that did not change are not counted again."""
        return float(sum(tile.known_cells for tile in self.tiles.values())) * self.resolution_m**2

    def to_grid(self) -> OccupancyGrid:
        """Return the known part as one grid, its origin on the lattice; 0 x 0 where nothing is known."""
        return assembled(self._cells, self.resolution_m)

    def known_box(self) -> tuple[int, int, int, int]:
        """Return the lattice (row0, col0, row1, col1) of the least box that holds every known cell, ends excluded."""
        return known_box(self._cells)

    @property
    def _cells(self) -> dict[TileIndex, NDArray[np.int8]]:
        return {index: tile.cells for index, tile in self.tiles.items()}

    @classmethod
    def from_grid(cls, grid: OccupancyGrid, revision: int = 1) -> TiledMap:
        """Return the grid as tiles, all of one revision; origins off the lattice move to the nearest cell."""
        tiles: dict[TileIndex, Tile] = {}
        if grid.cells.size == 0:
            return cls(grid.resolution_m, tiles, revision)
        cuts = [
            np.array([0, *range(TILE_CELLS - first % TILE_CELLS, size, TILE_CELLS)])
            for first, size in zip(grid.cell0, grid.shape, strict=True)
        ]
        by_row = [rows.max(axis=0) for rows in np.split(grid.cells, cuts[0][1:])]
        highest = np.maximum.reduceat(np.stack(by_row), cuts[1], axis=1)
        for r, c in np.argwhere(highest != UNKNOWN).tolist():
            row, col = grid.cell0[0] + int(cuts[0][r]), grid.cell0[1] + int(cuts[1][c])
            top, left = row % TILE_CELLS, col % TILE_CELLS
            part = grid.cells[cuts[0][r] :, cuts[1][c] :][: TILE_CELLS - top, : TILE_CELLS - left]
            cells = np.full((TILE_CELLS, TILE_CELLS), UNKNOWN, dtype=np.int8)
            cells[top : top + part.shape[0], left : left + part.shape[1]] = part
            cells.flags.writeable = False
            tiles[row // TILE_CELLS, col // TILE_CELLS] = Tile(revision, cells)
        return cls(grid.resolution_m, tiles, revision)

    def changed_since(self, revision: int) -> dict[TileIndex, Tile]:
        """Return the tiles that changed after this revision, in index order."""
        return {index: self.tiles[index] for index in sorted(self.tiles) if self.tiles[index].revision > revision}


@dataclass(frozen=True, eq=False)
class Keyframes:
    """Poses of a robot in its own map, as its best particle remembers them now (past poses get corrected)."""

    stamps_ns: NDArray[np.int64]
    """``(K,)``, nanoseconds."""
    T_map_base: NDArray[np.float64]
    """``(K, 3)``, metres and radians."""

    @classmethod
    def empty(cls) -> Keyframes:
        """Return no keyframes."""
        return cls(np.empty(0, dtype=np.int64), np.empty((0, 3)))


@dataclass(frozen=True, eq=False)
class LocalMap:
    """One robot's own map and keyframes at one revision: what the mapper returns and robots exchange.

    Raises ``InputError`` where there are scans of some keyframes only.
    """

    map: TiledMap
    keyframes: Keyframes = field(default_factory=Keyframes.empty)
    key_scans: KeyScans = field(default_factory=KeyScans.empty)
    """What was seen at each keyframe; empty where the map's maker keeps no scans."""

    def __post_init__(self) -> None:
        keyframes, scans = self.keyframes.stamps_ns.size, len(self.key_scans)
        if scans not in (0, keyframes):
            raise InputError(f"{keyframes} keyframes need as many scans or none, got {scans}")
