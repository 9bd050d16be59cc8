"""A robot that gives out a map that is not what it sees."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from mrslam.agent import Agent
from mrslam.spatial import TILE_CELLS, LocalMap, Tile, TiledMap
from mrslam.spatial.tiles import TileIndex

WAYS = ("rotated", "mirrored", "random")


class Liar(Agent):
    """Maps honestly, and tells another map, with its true trajectory."""

    def __init__(self, *args: Any, way: str, **kwargs: Any) -> None:
        """Take an agent's arguments, and one of :data:`WAYS`."""
        super().__init__(*args, **kwargs)
        self.way = way

    def local_map(self) -> LocalMap:
        """Return what it tells."""
        true = super().local_map()
        tiles: dict[TileIndex, Tile] = {}
        for (row, col), tile in true.map.tiles.items():
            if self.way == "mirrored":
                tiles[row, -1 - col] = Tile(tile.revision, np.ascontiguousarray(tile.cells[:, ::-1]))
            elif self.way == "rotated":  # by a quarter turn: (x, y) becomes (-y, x)
                tiles[col, -1 - row] = Tile(tile.revision, np.ascontiguousarray(np.rot90(tile.cells, -1)))
            else:
                rng = np.random.default_rng([row % 2**20, col % 2**20, tile.revision])
                cells = rng.choice(np.array([-1, 0, 100], dtype=np.int8), size=(TILE_CELLS, TILE_CELLS))
                tiles[row, col] = Tile(tile.revision, cells)
        for tile in tiles.values():
            tile.cells.flags.writeable = False
        return replace(true, map=TiledMap(true.map.resolution_m, tiles, true.map.revision))
