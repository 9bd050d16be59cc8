"""Rewriting a map cell by cell under a displacement that changes slowly from place to place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OCCUPIED, UNKNOWN = 65, -1
"""Equal ``mrslam.spatial.OCCUPIED_MIN`` and ``UNKNOWN``."""
TILE, EDGE = 64, 32
"""Edge of tiles and of blocks, four in a tile, cells; displacement is bilinear within a block, between its corners."""


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
    is_stale: NDArray[np.bool_],
    is_near: NDArray[np.bool_],
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    """Write what is stale of the tiles ``todo (M, 2)`` (row, column) of a bent map into ``out (M, 64, 64)``.

    ``slots (I, J)`` : of each tile in ``pool (N, 64, 64)``, -1 where nothing is known.
    ``field`` : ``(2 I + 1, 2 J + 1, 2)``, displacement (x, y) of the blocks' corners in cells. Every cell gets the
    value at the point that is moved to it; walls are then moved once more, forward, and joined to their neighbours, so
    that none is lost where the map is compressed or stretched. Blocks ``(2 I, 2 J)`` that are stale, but not
    ``is_near``, become unknown.
    """
    reach = int(math.ceil(np.max(np.abs(field)))) + 2
    for m in range(todo.shape[0]):
        for k in range(4):
            i, j = 2 * todo[m, 0] + k // 2, 2 * todo[m, 1] + k % 2
            if not is_stale[i, j]:
                continue
            r, c = (k // 2) * EDGE, (k % 2) * EDGE
            block = out[m, r : r + EDGE, c : c + EDGE]
            block[:] = UNKNOWN
            if is_near[i, j]:
                _fetch_block(pool, slots, field, i, j, block)
                _push_walls(pool, slots, field, (i, j, reach), block)


@njit(cache=True, nogil=True)
def _at(pool: NDArray[np.int8], slots: NDArray[np.int32], r: int, c: int) -> int:  # pragma: no cover - compiled
    """Return the value of a cell by its row and column from the first tile's on."""
    if r < 0 or c < 0 or r >= slots.shape[0] * TILE or c >= slots.shape[1] * TILE:
        return UNKNOWN
    n = slots[r // TILE, c // TILE]
    return UNKNOWN if n < 0 else pool[n, r % TILE, c % TILE]


@njit(cache=True, nogil=True)
def _fetch_block(
    pool: NDArray[np.int8], slots: NDArray[np.int32], field: NDArray[np.float32], i: int, j: int, out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Write block (i, j), ``out (32, 32)``, each cell from where it came.

    The displacement is inverted by one fixed-point step, with that of this block: enough, for it changes by a few per
    cent. It is linear along a row.
    """
    x00, x01, x10, x11 = field[i, j, 0], field[i, j + 1, 0], field[i + 1, j, 0], field[i + 1, j + 1, 0]
    y00, y01, y10, y11 = field[i, j, 1], field[i, j + 1, 1], field[i + 1, j, 1], field[i + 1, j + 1, 1]
    for r in range(EDGE):
        for c in range(EDGE):
            s, t = (c + 0.5) / EDGE, (r + 0.5) / EDGE
            for _ in range(2):
                dx = (1.0 - t) * ((1.0 - s) * x00 + s * x01) + t * ((1.0 - s) * x10 + s * x11)
                dy = (1.0 - t) * ((1.0 - s) * y00 + s * y01) + t * ((1.0 - s) * y10 + s * y11)
                s, t = (c + 0.5 - dx) / EDGE, (r + 0.5 - dy) / EDGE
            y, x = i * EDGE + int(math.floor(r + 0.5 - dy)), j * EDGE + int(math.floor(c + 0.5 - dx))
            out[r, c] = _at(pool, slots, y, x)


@njit(cache=True, nogil=True)
def _push_walls(
    pool: NDArray[np.int8],
    slots: NDArray[np.int32],
    field: NDArray[np.float32],
    block: tuple[int, int, int],
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    """Draw the wall cells that come to lie in a block, and what joins them to those above and to the right of them."""
    i, j, reach = block
    top, left = i * EDGE, j * EDGE
    bottom, right = min(top + EDGE + reach, slots.shape[0] * TILE), min(left + EDGE + reach, slots.shape[1] * TILE)
    for r in range(max(top - reach, 0), bottom):
        c = max(left - reach, 0)
        while c < right:
            n = slots[r // TILE, c // TILE]
            stop = min((c // TILE + 1) * TILE, right)
            if n >= 0:
                for at in range(c, stop):
                    if pool[n, r % TILE, at % TILE] >= OCCUPIED:
                        _push_wall(pool, slots, field, (r, at), (top, left), out)
            c = stop


@njit(cache=True, nogil=True)
def _push_wall(
    pool: NDArray[np.int8],
    slots: NDArray[np.int32],
    field: NDArray[np.float32],
    cell: tuple[int, int],
    corner: tuple[int, int],
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    r, c = cell
    value = _at(pool, slots, r, c)
    dx, dy = displaced(field, c + 0.5, r + 0.5)
    x, y = c + 0.5 + dx, r + 0.5 + dy
    _put(out, corner, x, y, value)
    for k in range(2):
        m, n = (r, c + 1) if k == 0 else (r + 1, c)
        other = _at(pool, slots, m, n)
        if other >= OCCUPIED:
            ex, ey = displaced(field, n + 0.5, m + 0.5)
            _put(out, corner, 0.5 * (x + n + 0.5 + ex), 0.5 * (y + m + 0.5 + ey), min(value, other))


@njit(cache=True, nogil=True)
def _put(
    out: NDArray[np.int8], corner: tuple[int, int], x: float, y: float, value: int
) -> None:  # pragma: no cover - compiled
    r, c = int(math.floor(y)) - corner[0], int(math.floor(x)) - corner[1]
    if 0 <= r < EDGE and 0 <= c < EDGE and out[r, c] < value:
        out[r, c] = value
