"""Cells of the map, packed in one 32-bit word each, and how a beam changes one.

From the lowest bit: hits (5 bit) | visits (6) | mean hit point x, y within the cell (6 + 6) | direction of the surface
normal (8) | whether there is a normal (1). Without a normal, the direction may be that to the laser; 0 where it is not
known. One load gives a beam all it needs, and a tile that particles share is
copied in 4 kB. Tiles are rows of a pool ``(T, 1024) uint32``; tile 0 is always empty and is never written to.
"""

from __future__ import annotations

import math
from typing import Any

from numba import njit

TILE = 32
"""Edge of a pool tile, cells; published tiles have ``mrslam.spatial.TILE_CELLS`` = 64."""
TILE_BITS = 5
"""log2 of ``TILE``."""
MASK = TILE - 1
"""Bits of a cell's row, or column, that say where in its tile it is."""
TILE_WORDS = TILE * TILE
"""Cells of a tile."""

NORMAL_QUALITY = 0.2
"""A point's normal is used where its quality (0..1, see ``mrslam.spatial.matching.scan_points``) is above this."""
HITS_CAP = 30
"""Counts are halved here, below the 5 bits' 31: the mean hit point can still follow what is seen."""
VISITS_CAP = 62
"""Counts are halved here, below the 6 bits' 63: what went away fades."""


@njit(cache=True, nogil=True, inline="always")
def hits_of(cell: Any) -> int:  # pragma: no cover - compiled
    """Return the number of beams that ended in the cell."""
    return cell & 0x1F


@njit(cache=True, nogil=True, inline="always")
def visits_of(cell: Any) -> int:  # pragma: no cover - compiled
    """Return the number of beams that ended in the cell or passed through it."""
    return (cell >> 5) & 0x3F


@njit(cache=True, nogil=True)
def add_hit(
    cell: Any, fx: float, fy: float, nx: float, ny: float, quality: float
) -> Any:  # pragma: no cover - compiled
    """Return the cell after one more hit at ``fx, fy`` in [0, 1) of the cell, with unit normal ``nx, ny``, map frame.

    ``quality`` : of the normal; where it is too low a cell with hits keeps the normal that it has. Where it is 0,
    ``nx, ny`` may be the direction to the laser instead, which a cell without hits keeps.

    Means are rounded up or down in the long run as often as their fraction asks (dithered by the digits below the
    stored ones), so that small changes add up in spite of the rounding.
    """
    hits, visits = hits_of(cell), visits_of(cell)
    mx, my = (cell >> 11) & 0x3F, (cell >> 17) & 0x3F
    direction, known = (cell >> 23) & 0xFF, (cell >> 31) & 1
    q = 1 if quality > NORMAL_QUALITY else 0
    x, y = fx * 64.0, fy * 64.0
    dither_x, dither_y = (fx * 4096.0) % 1.0, (fy * 4096.0) % 1.0
    fresh = 256.0 * (math.atan2(ny, nx) / (2.0 * math.pi) + 1.0)
    take = hits == 0
    if not take:
        turn = (fresh - direction + 384.0) % 256.0 - 128.0
        if known == 0 or q == 0 or abs(turn) < 64.0:
            share = 1.0 / (hits + 1.0)
            mx = int(math.floor(mx + (x - 0.5 - mx) * share + dither_x))
            my = int(math.floor(my + (y - 0.5 - my) * share + dither_y))
            if q > 0:
                if known == 0:
                    direction, known = int(fresh + 0.5) & 0xFF, 1
                else:
                    direction = int(math.floor(direction + turn * share + dither_y)) & 0xFF
        else:
            # The other side of a thin wall: one cell holds one surface, that seen more than once.
            take = hits <= 1
    if take:
        is_told = q > 0 or (quality == 0.0 and (nx != 0.0 or ny != 0.0))
        direction, known = int(fresh + 0.5) & 0xFF if is_told else 0, q
        mx, my = int(x), int(y)
    mx, my = min(max(mx, 0), 63), min(max(my, 0), 63)
    hits += 1
    visits += 1
    if visits >= VISITS_CAP or hits >= HITS_CAP:
        hits, visits = (hits + 1) >> 1, (visits + 1) >> 1
    return hits | (visits << 5) | (mx << 11) | (my << 17) | (direction << 23) | (known << 31)


@njit(cache=True, nogil=True, inline="always")
def add_pass(cell: Any) -> Any:  # pragma: no cover - compiled
    """Return the cell after one more beam passed through it."""
    visits = visits_of(cell) + 1
    if visits >= VISITS_CAP:
        return (cell & ~0x7FF) | (hits_of(cell) >> 1) | ((visits >> 1) << 5)
    return cell + 32
