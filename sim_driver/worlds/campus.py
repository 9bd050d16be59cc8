"""Campuses drawn at random: eight office buildings on 12 000 m2, with yards between them. One seed, one campus."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.sim_driver.worlds.office import office
from mrslam.spatial import OccupancyGrid

COLUMNS, ROWS = 2, 4
"""Buildings side by side, and one behind the other."""
WIDTH_M = (38.0, 46.0)
"""Widths that buildings are drawn from, metres; their depths are those of office floors, 8 to 25 m."""
YARD_M = 6.0
"""Width of the yards around the buildings, metres."""
ENTRANCE_M = 1.6
"""Width of an entrance, metres; there is one at either end of a building's longest corridor."""
TREES_EVERY_M2 = 25.0
"""Yard for each tree or planter, square metres: sparse enough to pass, dense enough for a laser of 8 m to see some."""
TREE_M = (0.3, 1.2)
"""Sides of trees and planters, metres."""
CLEAR_M = 1.0
"""Least free space around each of them, metres: a robot passes."""

Cells = NDArray[np.int8]


def campus(seed: int) -> OccupancyGrid:
    """Return a campus whose buildings all differ, each of them entered from two sides."""
    rng = np.random.default_rng(seed)
    buildings = [[building(rng) for _ in range(COLUMNS)] for _ in range(ROWS)]
    plan = Canvas(1.0, 1.0)
    depths = [max(one.shape[0] for one in row) for row in buildings]
    widths = [max(row[k].shape[1] for row in buildings) for k in range(COLUMNS)]
    yard = round(YARD_M / plan.resolution_m)
    height, width = sum(depths) + (ROWS + 1) * yard, sum(widths) + (COLUMNS + 1) * yard
    plan = Canvas(width * plan.resolution_m, height * plan.resolution_m)
    is_yard = plan.cells == 0
    for i, row in enumerate(buildings):
        for k, cells in enumerate(row):
            top, left = sum(depths[:i]) + (i + 1) * yard, sum(widths[:k]) + (k + 1) * yard
            here = np.s_[top : top + cells.shape[0], left : left + cells.shape[1]]
            plan.cells[here], is_yard[here] = cells, False
    _plant(plan, rng, is_yard)
    return plan.grid()


def building(rng: np.random.Generator) -> Cells:
    """Return the cells of an office floor, mirrored or not, with an entrance at both ends of a corridor."""
    cells = office(int(rng.integers(1 << 31)), float(rng.uniform(*WIDTH_M))).cells.copy()
    if rng.random() < 0.5:
        cells = cells[:, ::-1].copy()
    _enter(cells)
    _enter(cells[:, ::-1])
    return cells


def _enter(cells: Cells) -> None:
    """Open the wall on the left of a floor where the way in is the longest."""
    resolution_m = Canvas(1.0, 1.0).resolution_m
    wall = int(np.argmax((cells != 100).any(axis=0)))  # columns of the outer wall
    way_in = np.argmax(cells[:, wall:] == 100, axis=1)
    longest = np.flatnonzero(way_in >= 0.9 * way_in.max())
    middle, half = int(np.median(longest)), round(0.5 * ENTRANCE_M / resolution_m)
    cells[middle - half : middle + half, :wall] = 0


def _plant(plan: Canvas, rng: np.random.Generator, is_yard: NDArray[np.bool_]) -> None:
    """Put trees and planters into the yards, never near each other, a wall or an entrance."""
    height_m, width_m = (cells * plan.resolution_m for cells in plan.cells.shape)
    clear = round(CLEAR_M / plan.resolution_m)
    for _ in range(round(is_yard.sum() * plan.resolution_m**2 / TREES_EVERY_M2)):
        x, y = rng.uniform(0.0, width_m), rng.uniform(0.0, height_m)
        w, h = rng.uniform(*TREE_M, size=2)
        row, col, rows, cols = (round(v / plan.resolution_m) for v in (y, x, h, w))
        around = np.s_[max(row - clear, 0) : row + rows + clear, max(col - clear, 0) : col + cols + clear]
        if is_yard[around].all() and not plan.cells[around].any():
            plan.cells[row : row + rows, col : col + cols] = 100
