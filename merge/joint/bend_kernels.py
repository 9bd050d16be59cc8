"""Rewriting a map cell by cell under a displacement that changes slowly from place to place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OCCUPIED, UNKNOWN = 65, -1
"""Equal ``mrslam.spatial.OCCUPIED_MIN`` and ``UNKNOWN``."""
TILE, EDGE, TILE_BITS = 64, 32, 6
"""Edge of tiles (2^6) and of blocks, four in a tile, cells; displacement is bilinear within a
block, between its corners."""


@njit(cache=True, nogil=True)
def displaced(field: NDArray[np.float32], x: float, y: float) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the displacement (x, y) in cells at a point in cells; beyond the outermost nodes that of the edge."""
    u, v = x / EDGE, y / EDGE
    j = min(max(int(math.floor(u)), 0), field.shape[1] - 2)
    i = min(max(int(math.floor(v)), 0), field.shape[0] - 2)
    s, t = min(max(u - j, 0.0), 1.0), min(max(v - i, 0.0), 1.0)
    w00, w01, w10, w11 = (1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t
    dx = w00 * field[i, j, 0] + w01 * field[i, j + 1, 0] + w10 * field[i + 1, j, 0] + w11 * field[i + 1, j + 1, 0]
    dy = w00 * field[i, j, 1] + w01 * field[i, j + 1, 1] + w10 * field[i + 1, j, 1] + w11 * field[i + 1, j + 1, 1]
    return dx, dy


@njit(cache=True, nogil=True)
def bend_tiles(
    pool: NDArray[np.int8],
    slots: NDArray[np.int32],
    field: NDArray[np.float32],
    todo: NDArray[np.int64],
    is_drawn: NDArray[np.bool_],
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    """Write the blocks ``is_drawn (2 I, 2 J)`` of the tiles ``todo (M, 2)`` (row, column) into ``out (M, 64, 64)``.

    ``slots (I, J)`` : of each tile of the published map in ``pool (N, 64, 64)``, -1 where nothing is known.
    ``field`` : ``(2 I + 1, 2 J + 1, 2)``, displacement (x, y) of the blocks' corners in cells. Every cell gets the
    value at the point that is moved to it; walls are then moved once more, forward, and joined to their neighbours, so
    that none is lost where the map is compressed or stretched.
    """
    drawn = np.full(slots.shape, -1, dtype=np.int32)
    for m in range(todo.shape[0]):
        drawn[todo[m, 0], todo[m, 1]] = m
        for k in range(4):
            i, j = 2 * todo[m, 0] + k // 2, 2 * todo[m, 1] + k % 2
            if is_drawn[i, j]:
                r, c = (k // 2) * EDGE, (k % 2) * EDGE
                _fetch_block(pool, slots, field, i, j, out[m, r : r + EDGE, c : c + EDGE])
    reach = (int(math.ceil(np.max(np.abs(field)))) + 2 + TILE - 1) // TILE
    for i in range(slots.shape[0]):
        for j in range(slots.shape[1]):
            near = drawn[max(i - reach, 0) : i + reach + 1, max(j - reach, 0) : j + reach + 1]
            if slots[i, j] >= 0 and near.max() >= 0:
                _push_walls(pool, slots, field, (i, j), drawn, is_drawn, out)


@njit(cache=True, nogil=True)
def _at(pool: NDArray[np.int8], slots: NDArray[np.int32], r: int, c: int) -> int:  # pragma: no cover - compiled
    """Return the value of a cell by its row and column from the first tile's on."""
    slot = _slot(slots, r >> TILE_BITS, c >> TILE_BITS)
    return UNKNOWN if slot < 0 else pool[slot, r & (TILE - 1), c & (TILE - 1)]


@njit(cache=True, nogil=True)
def _slot(slots: NDArray[np.int32], i: int, j: int) -> int:  # pragma: no cover - compiled
    """Return where a tile is in the pool, -1 where it is unknown or beyond the map."""
    return slots[i, j] if 0 <= i < slots.shape[0] and 0 <= j < slots.shape[1] else -1


@njit(cache=True, nogil=True)
def _fetch_block(
    pool: NDArray[np.int8], slots: NDArray[np.int32], field: NDArray[np.float32], i: int, j: int, out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Write block (i, j), ``out (32, 32)``, each cell from where it came.

    The displacement is inverted by one fixed-point step, with that of this block: enough, for it changes by a few per
    cent.
    """
    x, y = _terms(field[i : i + 2, j : j + 2, 0]), _terms(field[i : i + 2, j : j + 2, 1])
    top, left = i * EDGE, j * EDGE
    tile, tile_i, tile_j, is_known = pool[0], -1, -1, False  # the tile looked at last: most often the next cell's, too
    for r in range(EDGE):
        for c in range(EDGE):
            s, t = (c + 0.5) / EDGE, (r + 0.5) / EDGE
            u, v = s - _moved(x, s, t) / EDGE, t - _moved(y, s, t) / EDGE
            row = top + int(math.floor(r + 0.5 - _moved(y, u, v)))
            col = left + int(math.floor(c + 0.5 - _moved(x, u, v)))
            if row >> TILE_BITS != tile_i or col >> TILE_BITS != tile_j:
                tile_i, tile_j = row >> TILE_BITS, col >> TILE_BITS
                slot = _slot(slots, tile_i, tile_j)
                is_known = slot >= 0
                if is_known:
                    tile = pool[slot]
            out[r, c] = tile[np.uint64(row & (TILE - 1)), np.uint64(col & (TILE - 1))] if is_known else UNKNOWN


@njit(cache=True, nogil=True)
def _terms(corners: NDArray[np.float32]) -> tuple[float, float, float, float]:  # pragma: no cover - compiled
    """Return a bilinear field's constant, its slopes along x and y, and its twist, by its corners ``(2, 2)``."""
    a, b, c, d = float(corners[0, 0]), float(corners[0, 1]), float(corners[1, 0]), float(corners[1, 1])
    return a, b - a, c - a, a - b - c + d


@njit(cache=True, nogil=True)
def _moved(terms: tuple[float, float, float, float], s: float, t: float) -> float:  # pragma: no cover - compiled
    return terms[0] + s * terms[1] + t * (terms[2] + s * terms[3])


@njit(cache=True, nogil=True)
def _push_walls(
    pool: NDArray[np.int8],
    slots: NDArray[np.int32],
    field: NDArray[np.float32],
    tile: tuple[int, int],
    drawn: NDArray[np.int32],
    is_drawn: NDArray[np.bool_],
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    """Draw a tile's wall cells where they come to lie, and what joins them to those above and to the right of them."""
    top, left = tile[0] * TILE, tile[1] * TILE
    cells = pool[slots[tile]]
    for r in range(TILE):
        for c in range(TILE):
            value = cells[r, c]
            if value < OCCUPIED:
                continue
            row, col = top + r, left + c
            dx, dy = displaced(field, col + 0.5, row + 0.5)
            x, y = col + 0.5 + dx, row + 0.5 + dy
            _put(drawn, is_drawn, out, x, y, value)
            for k in range(2):
                m, n = (row, col + 1) if k == 0 else (row + 1, col)
                other = _at(pool, slots, m, n)
                if other >= OCCUPIED:
                    ex, ey = displaced(field, n + 0.5, m + 0.5)
                    middle_x, middle_y = 0.5 * (x + n + 0.5 + ex), 0.5 * (y + m + 0.5 + ey)
                    _put(drawn, is_drawn, out, middle_x, middle_y, min(value, other))


@njit(cache=True, nogil=True)
def _put(
    drawn: NDArray[np.int32], is_drawn: NDArray[np.bool_], out: NDArray[np.int8], x: float, y: float, value: int
) -> None:  # pragma: no cover - compiled
    """Raise the cell at a point to a value, if its block is drawn."""
    r, c = int(math.floor(y)), int(math.floor(x))
    if r < 0 or c < 0 or r // EDGE >= is_drawn.shape[0] or c // EDGE >= is_drawn.shape[1]:
        return
    m = drawn[r // TILE, c // TILE]
    if m >= 0 and is_drawn[r // EDGE, c // EDGE]:
        r, c = r % TILE, c % TILE
        out[m, r, c] = max(out[m, r, c], value)
