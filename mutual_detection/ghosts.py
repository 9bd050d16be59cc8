"""What was mapped of teammates before anyone knew where they were.

A robot cannot drive through walls: what is drawn as occupied where a body has been is a teammate that stood or passed
there. This needs no scan, only paths: one's own, and those of teammates as they come with their maps.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from spatial import OccupancyGrid
from spatial.distance import euclidean

AROUND_M = 0.10
"""A speck is a ghost when all of it lies within the body's radius and so much more of a path: noise, alignment."""
INSIDE_M = 0.05
"""Cells deeper than this in the body's way are ghosts even where they touch a wall."""
LONGEST_STEP_M = 1.5
"""Path points farther apart than this are not joined: nobody knows the way between them."""


def clear_ghosts(
    grid: OccupancyGrid, paths_m: Sequence[NDArray[np.float64]], radius_m: float
) -> tuple[OccupancyGrid, int]:
    """Return the map without ghosts, and how many cells became free.

    ``paths_m`` : for each robot ``(K, 2)`` places it has been, in order, in the map's frame; ``radius_m`` : its body's.
    """
    swept = np.zeros(grid.shape, dtype=np.bool_)
    for path in paths_m:
        _draw(swept, grid, np.asarray(path, dtype=np.float64).reshape(-1, 2))
    occupied = grid.is_occupied
    if not swept.any() or not occupied.any():
        return grid, 0
    away_m = euclidean(swept) * grid.resolution_m
    specks, count = ndimage.label(occupied, structure=np.ones((3, 3), dtype=np.int8))
    farthest_m = ndimage.maximum(away_m, specks, index=np.arange(1, count + 1))
    is_ghost = np.concatenate([[False], np.asarray(farthest_m) <= radius_m + AROUND_M])
    ghosts = is_ghost[specks] | (occupied & (away_m <= radius_m - INSIDE_M))
    cleared = int(np.count_nonzero(ghosts))
    if cleared == 0:
        return grid, 0
    cells = grid.cells.copy()
    cells[ghosts] = 0
    return OccupancyGrid(cells, grid.resolution_m, grid.origin_m), cleared


def _draw(swept: NDArray[np.bool_], grid: OccupancyGrid, path_m: NDArray[np.float64]) -> None:
    path_m = path_m[np.isfinite(path_m).all(axis=1)]
    points = [path_m]
    for a, b in pairwise(path_m):
        length = float(np.hypot(*(b - a)))
        if length <= LONGEST_STEP_M:
            points.append(a + np.linspace(0.0, 1.0, int(length / grid.resolution_m) + 2)[:, None] * (b - a))
    cols, rows = np.floor((np.concatenate(points) - np.asarray(grid.origin_m)) / grid.resolution_m).astype(np.int64).T
    inside = (rows >= 0) & (rows < swept.shape[0]) & (cols >= 0) & (cols < swept.shape[1])
    swept[rows[inside], cols[inside]] = True
