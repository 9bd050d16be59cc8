"""A made-up building and partial maps of it, each in a frame of its own."""

from __future__ import annotations

import itertools

import numpy as np

from mrslam.alignment import Alignment, Evidence
from mrslam.merge import warp
from mrslam.spatial import OccupancyGrid, se2

RESOLUTION_M = 0.05


def building(seed: int = 0, rooms: int = 6, room_cells: int = 60) -> OccupancyGrid:
    """Return two rows of rooms of differing width along a corridor; walls one cell thick, with doors and clutter."""
    rng = np.random.default_rng(seed)
    widths = rng.integers(room_cells // 2, room_cells + 20, size=(2, rooms))
    widths[1, -1] += widths[0].sum() - widths[1].sum()
    width, depth, corridor = int(widths[0].sum()) + 1, room_cells, 30
    cells = np.full((2 * depth + corridor + 1, width), 0, dtype=np.int8)
    low, high = depth, depth + corridor
    for row in (0, low, high, 2 * depth + corridor):
        cells[row, :] = 100
    cells[:, [0, -1]] = 100
    for side, (bottom, top) in enumerate(((0, low), (high, 2 * depth + corridor))):
        edges = np.concatenate([[0], np.cumsum(widths[side])])
        for left, right in itertools.pairwise(edges):
            cells[bottom:top, min(right, width - 1)] = 100
            if right - left < 24:
                continue
            door = int(rng.integers(left + 4, right - 18))
            cells[low if side == 0 else high, door : door + 14] = 0
            for _ in range(int(rng.integers(1, 4))):
                r, c = int(rng.integers(bottom + 4, top - 10)), int(rng.integers(left + 3, right - 10))
                cells[r : r + int(rng.integers(2, 7)), c : c + int(rng.integers(2, 7))] = 100
    return OccupancyGrid(cells, RESOLUTION_M)


def part(plan: OccupancyGrid, col0: int, col1: int, T_part_plan: np.ndarray) -> OccupancyGrid:
    """Return the columns of the plan as a robot's map in its own frame."""
    cells = plan.cells[:, col0:col1]
    cut = OccupancyGrid.at_cell(cells, plan.resolution_m, plan.cell0[0], plan.cell0[1] + col0)
    return warp(cut, T_part_plan)


def alignment(T_a_b: np.ndarray, confidence: float = 0.9, sigma_m: float = 0.02, sigma_rad: float = 0.002) -> Alignment:
    """Return an accepted alignment."""
    return Alignment(
        np.asarray(T_a_b, dtype=float), confidence, Evidence(), np.diag([sigma_m, sigma_m, sigma_rad]) ** 2, "made up"
    )


def truth(poses: dict[str, np.ndarray], a: str, b: str) -> np.ndarray:
    """Return ``T_a_b`` of two maps whose frames lie at ``T_plan_map``."""
    return se2.between(poses[a], poses[b])
