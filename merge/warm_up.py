"""Compiling the kernels once, before agents start."""

from __future__ import annotations

import numpy as np

from mrslam.merge.grids.agreement import Walls, compare
from mrslam.merge.grids.fuse import fuse
from mrslam.merge.grids.warp import warp
from mrslam.spatial import OccupancyGrid, se2


def warm_up() -> None:
    """Compile the warping, fusing and comparing kernels by calling each once with a tiny map."""
    cells = np.zeros((8, 8), dtype=np.int8)
    cells[3, :] = 100
    grid = OccupancyGrid(cells, 0.05)
    turned = warp(grid, se2.transform(0.1, 0.2, 0.3))
    fuse([grid, turned], method="log-odds")
    walls = Walls(grid)
    compare(walls, walls, se2.IDENTITY, 0.1)
