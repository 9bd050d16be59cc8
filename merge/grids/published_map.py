"""A robot's map as it came: one grid, or tiles."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from mrslam.spatial import LocalMap, OccupancyGrid, TiledMap


class MapInTiles(Protocol):
    """A robot's map in tiles."""

    @property
    def local(self) -> LocalMap:
        """The map."""


PublishedMap = OccupancyGrid | MapInTiles


def as_it_is(known: PublishedMap) -> OccupancyGrid | TiledMap:
    """Return a map's cells without assembling them."""
    return known if isinstance(known, OccupancyGrid) else known.local.map


def is_same(one: PublishedMap, two: PublishedMap) -> bool:
    """Return whether two maps are known to have the same cells: in tiles, where those are the same objects."""
    before, after = as_it_is(one), as_it_is(two)
    if before.resolution_m != after.resolution_m:
        return False
    if isinstance(before, TiledMap) and isinstance(after, TiledMap):
        return before.tiles == after.tiles
    if isinstance(before, OccupancyGrid) and isinstance(after, OccupancyGrid):
        return before.origin_m == after.origin_m and np.array_equal(before.cells, after.cells)
    return False
