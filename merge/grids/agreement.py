"""Whether two placed maps can both be right: one's walls must not lie where the other saw free space."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.merge.grids.tiled_grid import TiledGrid, TileTable
from mrslam.spatial import FREE_MAX, OCCUPIED_MIN, TILE_CELLS, se2

BITS, INSIDE = TILE_CELLS.bit_length() - 1, TILE_CELLS - 1
"""A lattice row is in tile row ``row >> BITS``, there in row ``row & INSIDE``."""
ALL = np.uint64(2**64 - 1)
"""All bits of a word."""


@njit(cache=True, nogil=True)
def mark_near(
    pool: NDArray[np.int8], slots: NDArray[np.int32], widths: NDArray[np.int64], bits: NDArray[np.uint64]
) -> None:  # pragma: no cover - compiled
    """Set the bits of the cells near a map's walls: a bit a cell, a word a row of a tile.

    ``pool``, ``slots`` : the map's ``TileTable``; ``widths (2 R + 1,)`` : how many columns to either side of a wall are
    near in the rows from R before to R after it. ``bits (I + 2 rim, J + 2 rim, 64)`` : zeros, by tile of the table's
    box with a rim around it that nothing near a wall is beyond.
    """
    reach = widths.size // 2
    rim = (bits.shape[0] - slots.shape[0]) // 2
    for i in range(slots.shape[0]):
        for j in range(slots.shape[1]):
            if slots[i, j] < 0:
                continue
            tile = pool[slots[i, j]]
            for k in range(tile.shape[0]):
                for m in range(tile.shape[1]):
                    if tile[k, m] < OCCUPIED_MIN:
                        continue
                    row0, col = ((i + rim) << BITS) + k - reach, ((j + rim) << BITS) + m
                    for n in range(widths.size):
                        first, last = col - widths[n], col + widths[n]
                        for word in range(first >> BITS, (last >> BITS) + 1):
                            low, high = max(first - (word << BITS), 0), min(last - (word << BITS), INSIDE)
                            run = (ALL >> np.uint64(INSIDE - (high - low))) << np.uint64(low)
                            bits[(row0 + n) >> BITS, word, (row0 + n) & INSIDE] |= run


@njit(cache=True, nogil=True)
def count_walls(
    near: NDArray[np.uint64],
    free: NDArray[np.uint64],
    points_m: NDArray[np.float64],
    T_map_points: tuple[float, float, float, float],
    to_cells: tuple[float, float, float, float, float],
) -> tuple[int, int]:  # pragma: no cover - compiled
    """Return how many wall points agree with a map and how many are on its free space.

    ``near``, ``free`` : what is near its walls (:func:`mark_near`) and what is free (:func:`free_cells`); ``points_m
    (N, 2)`` : (x, y), laid on the map by ``T_map_points`` : x, y, cosine and sine. ``to_cells`` : the lattice's offset
    (x, y) and a cell's edge, metres, and the column and row of the corner of ``free``. A point agrees where it is near
    a wall; on unknown cells it says nothing else.
    """
    agree, against = 0, 0
    rim = (near.shape[0] - free.shape[0]) // 2
    x0, y0, cos, sin = T_map_points
    left, low, edge, col0, row0 = to_cells
    for k in range(points_m.shape[0]):
        x = x0 + cos * points_m[k, 0] - sin * points_m[k, 1]
        y = y0 + sin * points_m[k, 0] + cos * points_m[k, 1]
        c, r = int(np.floor((x - left) / edge - col0)), int(np.floor((y - low) / edge - row0))
        i, j = r >> BITS, c >> BITS
        if not (-rim <= i < free.shape[0] + rim and -rim <= j < free.shape[1] + rim):
            continue
        bit = np.uint64(c & INSIDE)
        if near[i + rim, j + rim, r & INSIDE] >> bit & np.uint64(1):
            agree += 1
        elif 0 <= i < free.shape[0] and 0 <= j < free.shape[1] and free[i, j, r & INSIDE] >> bit & np.uint64(1):
            against += 1
    return agree, against


def near_walls(tiled: TiledGrid, radius_cells: float) -> NDArray[np.uint64]:
    """Return which cells are within a radius of a map's walls, as :func:`count_walls` takes them."""
    reach = int(radius_cells)
    side2 = np.arange(-reach, reach + 1) ** 2
    widths = ((side2[:, None] + side2 <= radius_cells**2).sum(axis=1) - 1) // 2
    rim = (reach >> BITS) + 1
    _, pool, slots = TileTable.of(tiled.tiles)
    rows, cols = slots.shape
    bits = np.zeros((rows + 2 * rim, cols + 2 * rim, TILE_CELLS), dtype=np.uint64)
    mark_near(pool, slots, widths, bits)
    return bits


def free_cells(table: TileTable) -> NDArray[np.uint64]:
    """Return which cells of a map's box are free ``(I, J, 64)``, as :func:`count_walls` takes them."""
    _, pool, slots = table
    words = np.packbits((pool >= 0) & (pool <= FREE_MAX), axis=2, bitorder="little").view("<u8")
    bits = np.zeros((*slots.shape, TILE_CELLS), dtype=np.uint64)
    bits[slots >= 0] = words[slots[slots >= 0], :, 0]
    return bits


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
    """A map prepared for comparing: its walls as points, what is near them and what is free as bits."""

    def __init__(self, tiled: TiledGrid) -> None:
        self.tiled = tiled
        table = TileTable.of(tiled.tiles)
        at = np.flatnonzero(table.pool >= OCCUPIED_MIN)
        first = np.array(list(tiled.tiles), dtype=np.int64).reshape(-1, 2)[at >> 2 * BITS] * TILE_CELLS
        self.points_m = tiled.points_m(first + np.stack([at >> BITS & INSIDE, at & INSIDE], axis=1))
        self._free = free_cells(table)
        (row0, col0), (left_m, low_m) = table.tile0, tiled.offset_m
        corner = float(TILE_CELLS * col0), float(TILE_CELLS * row0)
        self._to_cells = float(left_m), float(low_m), float(tiled.resolution_m), *corner
        self._near: dict[float, NDArray[np.uint64]] = {}

    def count(
        self, points_m: NDArray[np.float64], near_m: float, T_map_points: se2.Transform = se2.IDENTITY
    ) -> tuple[int, int]:
        """Return how many points ``(N, 2)``, metres, are near its walls, and on its free space, laid on it so.

        What is near its walls is marked once: a team's maps are compared with each other, each with all.
        """
        if near_m not in self._near:
            self._near[near_m] = near_walls(self.tiled, near_m / self.tiled.resolution_m)
        x, y, theta = T_map_points
        laid = float(x), float(y), float(np.cos(theta)), float(np.sin(theta))
        points_m = np.ascontiguousarray(points_m)  # as a kernel takes it: another layout would be compiled anew
        found: tuple[int, int] = count_walls(self._near[near_m], self._free, points_m, laid, self._to_cells)
        return found


def count_near(tiled: TiledGrid, points_m: NDArray[np.float64], near_m: float) -> tuple[int, int]:
    """Return how many points ``(N, 2)`` (metres, a map's frame) are near its walls, and on its free space."""
    return Walls(tiled).count(points_m, near_m)


def compare(a: Walls, b: Walls, T_a_b: se2.Transform, near_m: float) -> Agreement:
    """Return the agreement of two maps with b placed at ``T_a_b (3,)``; walls within ``near_m`` metres agree."""
    b_in_a, a_in_b = a.count(b.points_m, near_m, T_a_b), b.count(a.points_m, near_m, se2.inverse(T_a_b))
    res_a, res_b = a.tiled.resolution_m, b.tiled.resolution_m
    return Agreement(agree_m=b_in_a[0] * res_b + a_in_b[0] * res_a, against_m=b_in_a[1] * res_b + a_in_b[1] * res_a)
