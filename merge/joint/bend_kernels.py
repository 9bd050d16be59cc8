"""Rewriting a map cell by cell under a displacement that changes slowly from place to place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.merge.grids.wall_kernels import LINKS, OCCUPIED, is_linked, is_thick
from mrslam.merge.grids.warp_kernels import sample

UNKNOWN = -1
"""Equals ``mrslam.spatial.UNKNOWN``."""
TILE, EDGE = 64, 32
"""Edge of tiles and of blocks, four in a tile, cells; displacement is bilinear within a block, between its corners."""
REACH = 3
"""Cells beyond those that are moved to a place that say how it is drawn there: how thick a wall is, what it joins."""


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
    value at the point that is moved to it, beside walls one cell thick; those are then moved forward, and joined to
    their neighbours: they stay one cell thick, and unbroken where the map is compressed or stretched.
    """
    reach = _most(field) + REACH
    far = (reach + EDGE - 1) // EDGE  # blocks beside those drawn from which anything can be moved into them
    cells = np.empty((TILE + 2 * reach, TILE + 2 * reach), dtype=np.int8)
    for m in range(todo.shape[0]):
        row0, col0 = todo[m, 0] * TILE - reach, todo[m, 1] * TILE - reach
        if not _gather(pool, slots, row0, col0, cells):
            continue
        i0, j0, i1, j1 = _drawn_box(is_drawn, 2 * todo[m, 0], 2 * todo[m, 1])
        for i in range(i0, i1):
            for j in range(j0, j1):
                r, c = (i % 2) * EDGE, (j % 2) * EDGE
                block = out[m, r : r + EDGE, c : c + EDGE]
                _fetch_block(cells, field, (i, j), (reach + r, reach + c), block)
        r, c = (i0 % 2) * EDGE, (j0 % 2) * EDGE
        box = out[m, r : r + (i1 - i0) * EDGE, c : c + (j1 - j0) * EDGE]
        near = field[max(i0 - far, 0) : i1 + far + 1, max(j0 - far, 0) : j1 + far + 1]
        _push_walls(cells, field, (i0 * EDGE, j0 * EDGE), (row0, col0), _most(near) + REACH, box)


@njit(cache=True, nogil=True)
def _drawn_box(is_drawn: NDArray[np.bool_], i: int, j: int) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Return first and last (row, column), ends excluded, of the box around the drawn ones of a tile's four blocks.

    ``i``, ``j`` : row and column of the tile's first block. What else is in the box is drawn as it was.
    """
    up, down = is_drawn[i, j] or is_drawn[i, j + 1], is_drawn[i + 1, j] or is_drawn[i + 1, j + 1]
    left, right = is_drawn[i, j] or is_drawn[i + 1, j], is_drawn[i, j + 1] or is_drawn[i + 1, j + 1]
    return i if up else i + 1, j if left else j + 1, i + 2 if down else i + 1, j + 2 if right else j + 1


@njit(cache=True, nogil=True)
def _most(field: NDArray[np.float32]) -> int:  # pragma: no cover - compiled
    """Return the largest displacement along x or y in whole cells, rounded up."""
    most = 0.0
    for i in range(field.shape[0]):
        for j in range(field.shape[1]):
            most = max(most, abs(field[i, j, 0]), abs(field[i, j, 1]))
    return int(math.ceil(most))


@njit(cache=True, nogil=True)
def _gather(
    pool: NDArray[np.int8], slots: NDArray[np.int32], row0: int, col0: int, out: NDArray[np.int8]
) -> bool:  # pragma: no cover - compiled
    """Write the cells of the map from (row0, col0) on into ``out``; return whether any of its tiles is known."""
    out[:] = UNKNOWN
    found = False
    for i in range(max(row0 // TILE, 0), min((row0 + out.shape[0] - 1) // TILE + 1, slots.shape[0])):
        for j in range(max(col0 // TILE, 0), min((col0 + out.shape[1] - 1) // TILE + 1, slots.shape[1])):
            if slots[i, j] >= 0:
                found = True
                top, left = max(i * TILE, row0), max(j * TILE, col0)
                bottom, right = min((i + 1) * TILE, row0 + out.shape[0]), min((j + 1) * TILE, col0 + out.shape[1])
                part = pool[slots[i, j], top - i * TILE : bottom - i * TILE, left - j * TILE : right - j * TILE]
                out[top - row0 : bottom - row0, left - col0 : right - col0] = part
    return found


@njit(cache=True, nogil=True)
def _fetch_block(
    cells: NDArray[np.int8],
    field: NDArray[np.float32],
    block: tuple[int, int],
    corner: tuple[int, int],
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    """Write a block, ``out (32, 32)``, whose own cells begin at ``corner`` of ``cells``, each from where it came.

    The displacement is inverted by one fixed-point step, with that of this block, and not beyond its corners: enough,
    for it changes by a few per cent.
    """
    i, j = block
    x, y = _terms(field[i : i + 2, j : j + 2, 0]), _terms(field[i : i + 2, j : j + 2, 1])
    for r in range(EDGE):
        for c in range(EDGE):
            s, t = (c + 0.5) / EDGE, (r + 0.5) / EDGE
            u = min(max(s - _moved(x, s, t) / EDGE, 0.0), 1.0)
            v = min(max(t - _moved(y, s, t) / EDGE, 0.0), 1.0)
            from_x, from_y = corner[1] + c + 0.5 - _moved(x, u, v), corner[0] + r + 0.5 - _moved(y, u, v)
            value = cells[int(from_y), int(from_x)]
            out[r, c] = value if value < OCCUPIED else sample(cells, from_x, from_y, True)


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
    cells: NDArray[np.int8],
    field: NDArray[np.float32],
    corner: tuple[int, int],
    cell0: tuple[int, int],
    reach: int,
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    """Draw the walls one cell thick that come to lie in ``out (H, W)``, and what joins them to others.

    ``corner``, ``cell0`` : (row, column) of the first of ``out`` and of ``cells`` in the map. Thicker ones are fetched.
    """
    top, left = corner
    first_row, first_col = max(top - reach - cell0[0], 1), max(left - reach - cell0[1], 1)
    last_row = min(top + out.shape[0] + reach - cell0[0], cells.shape[0] - 1)
    last_col = min(left + out.shape[1] + reach - cell0[1], cells.shape[1] - 1)
    for r in range(first_row, last_row):
        for c in range(first_col, last_col):
            value = cells[r, c]
            if value < OCCUPIED:
                continue
            thick = is_thick(cells, r, c)
            row, col = cell0[0] + r, cell0[1] + c
            dx, dy = displaced(field, col + 0.5, row + 0.5)
            x, y = col + 0.5 + dx - left, row + 0.5 + dy - top
            if not thick:
                _put(out, x, y, value)
            for k in range(4):
                dr, dc = LINKS[k]
                other = cells[r + dr, c + dc]
                if not is_linked(cells, r, c, dr, dc, False, True) or (thick and is_thick(cells, r + dr, c + dc)):
                    continue
                ex, ey = displaced(field, col + dc + 0.5, row + dr + 0.5)
                other_x, other_y = col + dc + 0.5 + ex - left, row + dr + 0.5 + ey - top
                _put(out, 0.5 * (x + other_x), 0.5 * (y + other_y), min(value, other))


@njit(cache=True, nogil=True)
def _put(out: NDArray[np.int8], x: float, y: float, value: int) -> None:  # pragma: no cover - compiled
    r, c = int(math.floor(y)), int(math.floor(x))
    if 0 <= r < out.shape[0] and 0 <= c < out.shape[1] and out[r, c] < value:
        out[r, c] = value
