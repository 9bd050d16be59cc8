"""Whether two placed maps can both be right: one's walls must not lie where the other saw free space."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial import FREE_MAX, OccupancyGrid, se2
from mrslam.spatial.distance import euclidean

BLOCK = 64
"""Least edge of the blocks of cells that distances to walls are kept in; a block without a wall nearer than its edge is
left out."""
FAR_M = 2.0
"""Least edge of such a block, metres: ``contradiction_tolerance_m`` (0.3 m) over a path of up to 44 alignments."""
MOST = np.iinfo(np.uint16).max
"""Largest squared distance kept, cells^2; larger ones are clipped."""
STRIP = 4
"""Rows of blocks whose distances are computed at once, plus one on either side: bounds memory."""


@njit(cache=True, nogil=True)
def count_walls(
    cells: NDArray[np.int8],
    block_at: NDArray[np.int32],
    distance2: NDArray[np.uint16],
    points: NDArray[np.float64],
    near_cells: float,
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return how many wall points ``(N, 2)`` (x, y in cells) agree with a grid and how many are on its free space.

    A point agrees within ``near_cells`` of a wall (less than a block's edge); on or near unknown cells it says nothing.
    ``block_at``, ``distance2``: see :func:`distances`.
    """
    height, width = cells.shape
    edge, limit = distance2.shape[1], min(near_cells * near_cells, MOST - 1.0)
    agree, against = 0, 0
    for k in range(points.shape[0]):
        c, r = int(np.floor(points[k, 0])), int(np.floor(points[k, 1]))
        if not (0 <= r < height and 0 <= c < width):
            continue
        block = block_at[r // edge, c // edge]
        if block >= 0 and distance2[block, r % edge, c % edge] <= limit:
            agree += 1
        elif 0 <= cells[r, c] <= FREE_MAX:
            against += 1
    return agree, against


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


def distances(is_wall: NDArray[np.bool_], edge: int = BLOCK) -> tuple[NDArray[np.int32], NDArray[np.uint16]]:
    """Return squared distances to the nearest wall, cells^2, of the blocks that have a distance less than ``edge``.

    ``block_at`` : ``(ceil(H / edge), ceil(W / edge))``, index of each block of ``is_wall (H, W)`` in ``distance2``, or
    -1; ``distance2`` : ``(K, edge, edge)``. The whole field of a long diagonal corridor took hundreds of megabytes.
    """
    height, width = is_wall.shape
    rows, cols = -(-height // edge), -(-width // edge)
    block_at = np.full((rows, cols), -1, dtype=np.int32)
    kept: list[NDArray[np.uint16]] = []
    for i0 in range(0, rows, STRIP):
        top, bottom = max(0, (i0 - 1) * edge), min(height, (i0 + STRIP + 1) * edge)
        if not is_wall[top:bottom].any():
            continue
        field = euclidean(is_wall[top:bottom])
        for i in range(i0, min(i0 + STRIP, rows)):
            for j in range(cols):
                part = field[i * edge - top : (i + 1) * edge - top, j * edge : (j + 1) * edge]
                if part.min() < edge:
                    block_at[i, j] = len(kept)
                    kept.append(np.pad(_squared(part), [(0, edge - n) for n in part.shape]))
    return block_at, np.stack(kept) if kept else np.empty((0, edge, edge), dtype=np.uint16)


def _squared(distance: NDArray[np.float32]) -> NDArray[np.uint16]:
    return np.asarray(np.rint(np.minimum(distance, MOST) ** 2).clip(0, MOST), dtype=np.uint16)


class Walls:
    """A map prepared for comparing: its walls as points, and the distance to them."""

    def __init__(self, grid: OccupancyGrid) -> None:
        self.grid = grid
        self.points_m = grid.centres(grid.is_occupied)
        self.block_at, self.distance2 = distances(grid.is_occupied, max(BLOCK, math.ceil(FAR_M / grid.resolution_m)))

    def count(self, points_m: NDArray[np.float64], near_m: float) -> tuple[float, float]:
        """Return how many points ``(N, 2)`` (metres, this map's frame) are near its walls, and on its free space."""
        points = (points_m - np.asarray(self.grid.origin_m)) / self.grid.resolution_m
        near = near_m / self.grid.resolution_m
        agree, against = count_walls(self.grid.cells, self.block_at, self.distance2, points, near)
        return float(agree), float(against)


def compare(a: Walls, b: Walls, T_a_b: se2.Transform, near_m: float) -> Agreement:
    """Return the agreement of two maps with b placed at ``T_a_b (3,)``; walls within ``near_m`` metres agree."""
    b_in_a = a.count(se2.apply(T_a_b, b.points_m), near_m)
    a_in_b = b.count(se2.apply(se2.inverse(T_a_b), a.points_m), near_m)
    res_a, res_b = a.grid.resolution_m, b.grid.resolution_m
    return Agreement(agree_m=b_in_a[0] * res_b + a_in_b[0] * res_a, against_m=b_in_a[1] * res_b + a_in_b[1] * res_a)
