"""The map's surface nearest to a beam's end: one load a cell, the beam's own cell first."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit

from mrslam.spatial.hits.cells import MASK, TILE_BITS
from mrslam.spatial.hits.views import Tiles

DIRECTIONS = 256
"""Directions that a cell's normal can have: 8 bits of its word."""
ANGLES = np.arange(DIRECTIONS) * (2.0 * math.pi / DIRECTIONS)
"""``(256,)``, radians."""
COS, SIN = np.cos(ANGLES), np.sin(ANGLES)
"""``(256,)``, of the directions."""
WALL_SHARE = 5
"""A cell is wall where at least one beam in this number that came there ended in it."""
FACING = 0.35
"""Two normals are of one surface where the cosine of the angle between them is at least this: 70 degrees."""
NEXT_CELLS2 = 0.25
"""Square of half a cell, cells^2: the own cell's mean point is taken at once if nearer; another's is hardly nearer."""


class Surface(NamedTuple):
    """What the map has near a point."""

    word: Any
    """Word of the nearest occupied cell, see :mod:`mrslam.spatial.hits.cells`; 0 where there is none."""
    dx: float
    """Mean hit point of that cell minus the point asked for, x, map frame, cells."""
    dy: float
    """The same in y."""
    distance2: float
    """Square of their distance, cells^2."""
    visits: int
    """Where no surface was found: visits of the point's own cell, above 0 where it is known to be free; else 0."""


@njit(cache=True, nogil=True, inline="always")
def _is_wall(word: Any) -> bool:  # pragma: no cover - compiled
    """Return whether a cell is occupied."""
    hits = word & 0x1F
    return hits != 0 and hits * WALL_SHARE >= (word >> 5) & 0x3F


@njit(cache=True, nogil=True, inline="always")
def _is_facing(word: Any, nx: float, ny: float, quality: float) -> bool:  # pragma: no cover - compiled
    """Return whether a cell's normal, if it has one, looks the same way as a point's, or to the laser that saw it."""
    k = (word >> 23) & 0xFF
    is_known = (word >> 31) & 1 == 1
    if k == 0 and not is_known:
        return True
    return nx * COS[k] + ny * SIN[k] >= (FACING if quality > 0.0 and is_known else 0.0)


@njit(cache=True, nogil=True)
def nearest(
    tiles: Tiles, x: float, y: float, nx: float, ny: float, quality: float, radius: int
) -> Surface:  # pragma: no cover - compiled
    """Return the occupied cell nearest to ``(x, y)``, cells, of those at most ``radius`` rows and columns away.

    ``(nx, ny)`` is the point's unit normal if its ``quality`` is above 0: cells whose normal looks the other way belong
    to another surface. The window's outermost tiles count as unknown (:meth:`TileStore.cover` keeps one to spare).
    """
    pool, table, row0, col0 = tiles.pool, tiles.table, tiles.row0, tiles.col0
    height, width = table.shape
    col, row = int(math.floor(x)), int(math.floor(y))
    best: Any = np.int64(0)
    best_dx, best_dy, best_d2 = 0.0, 0.0, 1e30
    tr, tc = (row >> TILE_BITS) - row0, (col >> TILE_BITS) - col0
    if not (1 <= tr < height - 1 and 1 <= tc < width - 1):
        return Surface(best, 0.0, 0.0, best_d2, 0)
    here: Any = 0
    inside = radius <= (row & MASK) <= MASK - radius and radius <= (col & MASK) <= MASK - radius
    tile = table[tr, tc]
    if inside and tile == 0:
        return Surface(best, 0.0, 0.0, best_d2, 0)
    if tile != 0:
        word = np.int64(pool[tile, ((row & MASK) << TILE_BITS) | (col & MASK)])
        if _is_wall(word):
            dx = col + (((word >> 11) & 0x3F) + 0.5) * (1.0 / 64.0) - x
            dy = row + (((word >> 17) & 0x3F) + 0.5) * (1.0 / 64.0) - y
            d2 = dx * dx + dy * dy
            if d2 < NEXT_CELLS2 and _is_facing(word, nx, ny, quality):
                return Surface(word, dx, dy, d2, 0)
    for r in range(row - radius, row + radius + 1):
        for q in range(col - radius, col + radius + 1):
            if not inside:
                tile = table[(r >> TILE_BITS) - row0, (q >> TILE_BITS) - col0]
            word = np.int64(pool[tile, ((r & MASK) << TILE_BITS) | (q & MASK)])
            if r == row and q == col:
                here = (word >> 5) & 0x3F
            if not _is_wall(word):
                continue
            dx = q + (((word >> 11) & 0x3F) + 0.5) * (1.0 / 64.0) - x
            dy = r + (((word >> 17) & 0x3F) + 0.5) * (1.0 / 64.0) - y
            d2 = dx * dx + dy * dy
            if d2 < best_d2 and _is_facing(word, nx, ny, quality):
                best, best_dx, best_dy, best_d2 = word, dx, dy, d2
    if best == 0:
        return Surface(np.int64(0), 0.0, 0.0, 1e30, here)
    return Surface(best, best_dx, best_dy, best_d2, 0)
