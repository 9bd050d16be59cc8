"""A robot's map and what is derived from it."""

from __future__ import annotations

import weakref

import numpy as np

from mrslam.agent.known_map import KnownMap
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, TiledMap


def test_a_grid_is_held_while_somebody_uses_it_and_not_by_the_map() -> None:
    cells = np.full((100, 120), -1, dtype=np.int8)
    cells[20:80, 10:90] = 0
    drawn = OccupancyGrid(cells, 0.05, (-1.0, 2.0))
    known = KnownMap((1, 1), LocalMap(TiledMap.from_grid(drawn), Keyframes.empty()))
    grid = known.grid
    assert known.grid is grid  # who aligns it with several others prepares one grid
    ref, content = weakref.ref(grid), grid.cells.tobytes()
    del grid
    assert ref() is None
    assert known.grid.cells.tobytes() == content
