"""The map's surface nearest to a beam's end: one load a cell, the beam's own cell first."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.rbpf.tiles.cells import MASK, TILE_BITS

DIRECTIONS = 256


def direction_tables() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return cos and sin of the 256 directions a cell's normal can have."""
    angles = np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS)
    return np.cos(angles), np.sin(angles)


COS, SIN = direction_tables()


@njit(cache=True, nogil=True)
def nearest(
    pool: NDArray[np.uint32],
    table: NDArray[np.int32],
    row0: int,
    col0: int,
    x: float,
    y: float,
    nx: float,
    ny: float,
    quality: float,
    radius: int,
    cos_table: NDArray[np.float64],
    sin_table: NDArray[np.float64],
) -> tuple[Any, float, float, float]:  # pragma: no cover - compiled
    """Return the nearest occupied cell's word (0: none), its mean point minus (x, y) in cells, and their distance^2.

    Cells whose normal looks the other way belong to another surface. The second value of a miss is the visits of the
    cell at (x, y): positive where the map knows that there is nothing.
    """
    height, width = table.shape
    col, row = int(math.floor(x)), int(math.floor(y))
    best: Any = np.int64(0)
    best_dx, best_dy, best_d2 = 0.0, 0.0, 1e30
    tr, tc = (row >> TILE_BITS) - row0, (col >> TILE_BITS) - col0
    if not (1 <= tr < height - 1 and 1 <= tc < width - 1):
        return best, 0.0, 0.0, best_d2
    here: Any = 0
    inside = radius <= (row & MASK) <= MASK - radius and radius <= (col & MASK) <= MASK - radius
    tile = table[tr, tc]
    if inside and tile == 0:
        return best, 0.0, 0.0, best_d2
    if tile != 0:
        word = np.int64(pool[tile, ((row & MASK) << TILE_BITS) | (col & MASK)])
        hits = word & 0x1F
        if hits != 0 and hits * 5 >= (word >> 5) & 0x3F:
            dx = col + (((word >> 11) & 0x3F) + 0.5) * (1.0 / 64.0) - x
            dy = row + (((word >> 17) & 0x3F) + 0.5) * (1.0 / 64.0) - y
            d2 = dx * dx + dy * dy
            if d2 < 0.25:  # half a cell away: another cell's mean is hardly nearer
                k = (word >> 23) & 0xFF
                if quality == 0.0 or (word >> 31) & 1 == 0 or nx * cos_table[k] + ny * sin_table[k] >= 0.35:
                    return word, dx, dy, d2
    for r in range(row - radius, row + radius + 1):
        for q in range(col - radius, col + radius + 1):
            if not inside:
                tile = table[(r >> TILE_BITS) - row0, (q >> TILE_BITS) - col0]
            word = np.int64(pool[tile, ((r & MASK) << TILE_BITS) | (q & MASK)])
            if r == row and q == col:
                here = (word >> 5) & 0x3F
            hits = word & 0x1F
            if hits == 0 or hits * 5 < (word >> 5) & 0x3F:
                continue
            dx = q + (((word >> 11) & 0x3F) + 0.5) * (1.0 / 64.0) - x
            dy = r + (((word >> 17) & 0x3F) + 0.5) * (1.0 / 64.0) - y
            d2 = dx * dx + dy * dy
            if d2 < best_d2:
                if quality > 0.0 and (word >> 31) & 1 > 0:
                    k = (word >> 23) & 0xFF
                    if nx * cos_table[k] + ny * sin_table[k] < 0.35:
                        continue
                best, best_dx, best_dy, best_d2 = word, dx, dy, d2
    if best == 0:
        return np.int64(0), float(here), 0.0, 1e30
    return best, best_dx, best_dy, best_d2
