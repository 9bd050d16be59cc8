"""What sending maps whole would cost, to compare exchanges with; only bands that changed are compressed again."""

from __future__ import annotations

from collections import defaultdict

from mrslam.comms.wire.tile_codec import lz4_bytes
from mrslam.spatial import TILE_CELLS, Tile, TiledMap
from mrslam.spatial.tiles import window

_Band = tuple[tuple[int, int, int, int], tuple[tuple[int, Tile], ...]]
"""Lattice (row0, col0, row1, col1) of a band of cells, and the tiles of its row with their columns."""


class WholeSizes:
    """Remembers, by map, the bands it was measured by last."""

    def __init__(self) -> None:
        self._sizes: dict[str, dict[_Band, int]] = {}

    def of(self, map_id: str, tiled: TiledMap) -> tuple[int, int]:
        """Return the size of a map as LZ4 of its cropped grid, as mrgs (Martins et al. 2021) sends it, and raw, bytes.

        It is compressed in bands of a tile's height; what that adds is below a hundredth.
        """
        row0, col0, row1, col1 = tiled.known_box()
        by_row: defaultdict[int, list[tuple[int, Tile]]] = defaultdict(list)
        for i, j in sorted(tiled.tiles):
            by_row[i].append((j, tiled.tiles[i, j]))
        before, sizes = self._sizes.get(map_id, {}), {}
        for i in range(row0 // TILE_CELLS, -(-row1 // TILE_CELLS)):
            top, bottom = max(row0, i * TILE_CELLS), min(row1, (i + 1) * TILE_CELLS)
            band = (top, col0, bottom, col1), tuple(by_row[i])
            sizes[band] = before[band] if band in before else _compressed(band)
        self._sizes[map_id] = sizes
        return sum(sizes.values()), (row1 - row0) * (col1 - col0)


def _compressed(band: _Band) -> int:
    """Return the size of a band as one LZ4 block, bytes."""
    (row0, col0, row1, col1), tiles = band
    cells = {(row0 // TILE_CELLS, j): tile.cells for j, tile in tiles}
    return lz4_bytes(window(cells, row0, col0, row1 - row0, col1 - col0))
