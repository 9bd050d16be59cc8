"""Whether two placed maps can both be right: one's walls must not lie where the other saw free space."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, TILE_CELLS, se2

BITS, INSIDE = TILE_CELLS.bit_length() - 1, TILE_CELLS - 1
"""A lattice row is in tile row ``row >> BITS``, there in row ``row & INSIDE``."""


@njit(cache=True, nogil=True)
def count_walls(
    pool: NDArray[np.int8], slots: NDArray[np.int32], points: NDArray[np.float64], offsets: NDArray[np.int64]
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return how many wall points agree with a map and how many are on its free space.

    ``pool``, ``slots`` : the map's ``TileTable``; ``points (N, 2)`` : (x, y) in cells from its corner. A point agrees
    where one of the cells at ``offsets (K, 2)`` from its own (row, column) is a wall; on or near unknown cells it says
    nothing.
    """
    agree, against = 0, 0
    reach = np.max(np.abs(offsets))
    side = (2 * reach >> BITS) + 2
    near = np.empty((side, side), dtype=np.int32)
    for k in range(points.shape[0]):
        c, r = int(np.floor(points[k, 0])), int(np.floor(points[k, 1]))
        i, j = (r - reach) >> BITS, (c - reach) >> BITS
        for u in range(side):
            for v in range(side):
                is_inside = 0 <= i + u < slots.shape[0] and 0 <= j + v < slots.shape[1]
                near[u, v] = slots[i + u, j + v] if is_inside else -1
        if near.max() < 0:
            continue
        is_near = False
        for m in range(offsets.shape[0]):
            row, col = r + offsets[m, 0], c + offsets[m, 1]
            slot = near[(row >> BITS) - i, (col >> BITS) - j]
            if slot >= 0 and pool[slot, row & INSIDE, col & INSIDE] >= OCCUPIED_MIN:
                is_near = True
                break
        own = near[(r >> BITS) - i, (c >> BITS) - j]
        if is_near:
            agree += 1
        elif own >= 0 and 0 <= pool[own, r & INSIDE, c & INSIDE] <= FREE_MAX:
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

    def __init__(self, tiled: TiledGrid) -> None:
        self.tiled = tiled
        at = np.flatnonzero(tiled.table.pool >= OCCUPIED_MIN)
        first = np.array(list(tiled.tiles), dtype=np.int64).reshape(-1, 2)[at >> 2 * BITS] * TILE_CELLS
        self.points_m = tiled.points_m(first + np.stack([at >> BITS & INSIDE, at & INSIDE], axis=1))


def count_near(tiled: TiledGrid, points_m: NDArray[np.float64], near_m: float) -> tuple[int, int]:
    """Return how many points ``(N, 2)`` (metres, a map's frame) are near its walls, and on its free space."""
    table, edge_m = tiled.table, tiled.resolution_m
    points = (points_m - np.asarray(tiled.offset_m)) / edge_m - TILE_CELLS * np.array(table.tile0)[::-1]
    found: tuple[int, int] = count_walls(table.pool, table.slots, points, disc(near_m / edge_m))
    return found


def compare(a: Walls, b: Walls, T_a_b: se2.Transform, near_m: float) -> Agreement:
    """Return the agreement of two maps with b placed at ``T_a_b (3,)``; walls within ``near_m`` metres agree."""
    b_in_a = count_near(a.tiled, se2.apply(T_a_b, b.points_m), near_m)
    a_in_b = count_near(b.tiled, se2.apply(se2.inverse(T_a_b), a.points_m), near_m)
    res_a, res_b = a.tiled.resolution_m, b.tiled.resolution_m
    return Agreement(agree_m=b_in_a[0] * res_b + a_in_b[0] * res_a, against_m=b_in_a[1] * res_b + a_in_b[1] * res_a)
