"""Whether two placed maps can both be right: one's walls must not lie where the other saw free space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, OccupancyGrid, se2


@njit(cache=True, nogil=True)
def count_walls(
    cells: NDArray[np.int8], points: NDArray[np.float64], offsets: NDArray[np.int64]
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return how many wall points ``(N, 2)`` (x, y in cells) agree with a grid and how many are on its free space.

    A point agrees where one of the cells at ``offsets (K, 2)`` from its own (row, column) is a wall; on or near unknown
    cells it says nothing.
    """
    height, width = cells.shape
    agree, against = 0, 0
    for k in range(points.shape[0]):
        c, r = int(np.floor(points[k, 0])), int(np.floor(points[k, 1]))
        if not (0 <= r < height and 0 <= c < width):
            continue
        is_near = False
        for m in range(offsets.shape[0]):
            i, j = r + offsets[m, 0], c + offsets[m, 1]
            if 0 <= i < height and 0 <= j < width and cells[i, j] >= OCCUPIED_MIN:
                is_near = True
                break
        if is_near:
            agree += 1
        elif 0 <= cells[r, c] <= FREE_MAX:
            against += 1
    return agree, against


@lru_cache(maxsize=64)
def disc(radius_cells: float) -> NDArray[np.int64]:
    """Return the offsets (row, column) of the cells within a radius, the nearest first: ``(K, 2)``, for reading only.

    Cached: a team's maps are compared by some radius for each number of alignments between them, thousands of times.
    """
    reach = int(radius_cells)
    side = np.arange(-reach, reach + 1)
    offsets = np.stack(np.meshgrid(side, side, indexing="ij"), axis=-1).reshape(-1, 2)
    distance2 = (offsets**2).sum(axis=1)
    order = np.argsort(distance2, kind="stable")
    return np.ascontiguousarray(offsets[order][distance2[order] <= radius_cells**2])


@dataclass(frozen=True, kw_only=True)
class Agreement:
    """How well two maps agree where both are known."""

    agree_m: float
    """Length of wall (cells x resolution) near the other map's walls, both ways."""
    against_m: float
    """Length of wall on the other map's free space, both ways."""

    @property
    def share_against(self) -> float:
        """Share of the wall compared that is on free space, 0..1."""
        return self.against_m / max(self.agree_m + self.against_m, 1e-9)


class Walls:
    """A map prepared for comparing: its walls as points."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self.points_m = grid.centres(grid.is_occupied)

    def count(self, points_m: NDArray[np.float64], near_m: float) -> tuple[float, float]:
        """Return how many points ``(N, 2)`` (metres, this map's frame) are near its walls, and on its free space."""
        points = (points_m - np.asarray(self.grid.origin_m)) / self.grid.resolution_m
        agree, against = count_walls(self.grid.cells, points, disc(near_m / self.grid.resolution_m))
        return float(agree), float(against)


def compare(a: Walls, b: Walls, T_a_b: se2.Transform, near_m: float) -> Agreement:
    """Return the agreement of two maps with b placed at ``T_a_b (3,)``; walls within ``near_m`` metres agree."""
    b_in_a = a.count(se2.apply(T_a_b, b.points_m), near_m)
    a_in_b = b.count(se2.apply(se2.inverse(T_a_b), a.points_m), near_m)
    res_a, res_b = a.grid.resolution_m, b.grid.resolution_m
    return Agreement(agree_m=b_in_a[0] * res_b + a_in_b[0] * res_a, against_m=b_in_a[1] * res_b + a_in_b[1] * res_a)
