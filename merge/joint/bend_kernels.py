"""Rewriting a map cell by cell under a displacement that changes slowly from place to place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OCCUPIED, UNKNOWN = 65, -1
"""Equal ``mrslam.spatial.OCCUPIED_MIN`` and ``UNKNOWN``."""
EDGE = 32
"""Edge of the blocks, cells; displacement is bilinear within a block, between its corners."""


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
def bend_blocks(
    cells: NDArray[np.int8],
    field: NDArray[np.float32],
    is_stale: NDArray[np.bool_],
    is_near: NDArray[np.bool_],
    out: NDArray[np.int8],
) -> None:  # pragma: no cover - compiled
    """Write the blocks ``is_stale (R, C)`` of ``out (32 R, 32 C)``: ``cells``, of the same shape, moved by ``field``.

    ``field`` : ``(R + 1, C + 1, 2)``, displacement (x, y) of the blocks' corners in cells. Every cell gets the value
    at the point that is moved to it; walls are then moved once more, forward, and joined to their neighbours, so that
    none is lost where the map is compressed or stretched. Blocks that are not ``is_near (R, C)`` become unknown.
    """
    reach = int(math.ceil(np.max(np.abs(field)))) + 2
    for i in range(is_stale.shape[0]):
        for j in range(is_stale.shape[1]):
            if is_stale[i, j]:
                out[i * EDGE : (i + 1) * EDGE, j * EDGE : (j + 1) * EDGE] = UNKNOWN
            if is_stale[i, j] and is_near[i, j]:
                _fetch_block(cells, field, i, j, out)
                _push_walls(cells, field, (i, j, reach), out)


@njit(cache=True, nogil=True)
def _fetch_block(
    cells: NDArray[np.int8], field: NDArray[np.float32], i: int, j: int, out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Write block (i, j) of ``out``, each cell from where it came.

    The displacement is inverted by one fixed-point step, with that of this block: enough, for it changes by a few per
    cent. It is linear along a row.
    """
    height, width = cells.shape
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
            if 0 <= y < height and 0 <= x < width:
                out[i * EDGE + r, j * EDGE + c] = cells[y, x]


@njit(cache=True, nogil=True)
def _push_walls(
    cells: NDArray[np.int8], field: NDArray[np.float32], block: tuple[int, int, int], out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Draw the wall cells that come to lie in a block, and what joins them to those above and to the right of them."""
    i, j, reach = block
    top, left = i * EDGE, j * EDGE
    for r in range(max(top - reach, 0), min(top + EDGE + reach, cells.shape[0])):
        for c in range(max(left - reach, 0), min(left + EDGE + reach, cells.shape[1])):
            if cells[r, c] < OCCUPIED:
                continue
            dx, dy = displaced(field, c + 0.5, r + 0.5)
            x, y = c + 0.5 + dx, r + 0.5 + dy
            _put(out, top, left, x, y, cells[r, c])
            for k in range(2):
                m, n = (r, c + 1) if k == 0 else (r + 1, c)
                if m < cells.shape[0] and n < cells.shape[1] and cells[m, n] >= OCCUPIED:
                    ex, ey = displaced(field, n + 0.5, m + 0.5)
                    joint_x, joint_y = 0.5 * (x + n + 0.5 + ex), 0.5 * (y + m + 0.5 + ey)
                    _put(out, top, left, joint_x, joint_y, min(cells[r, c], cells[m, n]))


@njit(cache=True, nogil=True)
def _put(
    out: NDArray[np.int8], top: int, left: int, x: float, y: float, value: int
) -> None:  # pragma: no cover - compiled
    r, c = int(math.floor(y)), int(math.floor(x))
    if top <= r < top + EDGE and left <= c < left + EDGE and out[r, c] < value:
        out[r, c] = value
