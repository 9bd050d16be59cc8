"""Rewriting a map cell by cell under a displacement that changes slowly from place to place."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OCCUPIED = 65
"""Equals ``mrslam.spatial.OCCUPIED_MIN``."""
BLOCK = 32
"""Edge of the blocks that are skipped where all is unknown, cells."""


@njit(cache=True, nogil=True)
def displaced(
    field: NDArray[np.float32], node: int, row0: int, col0: int, x: float, y: float
) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the displacement (x, y) in cells at a point in cells, between the nodes around it."""
    u, v = (x - col0) / node, (y - row0) / node
    j = min(max(int(math.floor(u)), 0), field.shape[1] - 2)
    i = min(max(int(math.floor(v)), 0), field.shape[0] - 2)
    s, t = min(max(u - j, 0.0), 1.0), min(max(v - i, 0.0), 1.0)
    w00, w01, w10, w11 = (1.0 - s) * (1.0 - t), s * (1.0 - t), (1.0 - s) * t, s * t
    dx = w00 * field[i, j, 0] + w01 * field[i, j + 1, 0] + w10 * field[i + 1, j, 0] + w11 * field[i + 1, j + 1, 0]
    dy = w00 * field[i, j, 1] + w01 * field[i, j + 1, 1] + w10 * field[i + 1, j, 1] + w11 * field[i + 1, j + 1, 1]
    return dx, dy


@njit(cache=True, nogil=True)
def bend_cells(
    cells: NDArray[np.int8], field: NDArray[np.float32], node: int, row0: int, col0: int, out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Write ``cells (H, W)`` moved by ``field (R, C, 2)`` into ``out (H, W)``.

    Node (0, 0) of the field is at cell corner (row0, col0), the others every ``node`` cells; a displacement is (x, y)
    in cells. Every cell gets the value at the point that is moved to it; walls are then moved once more, forward, and
    joined to their neighbours, so that none is lost where the map is compressed or stretched.
    """
    reach = int(math.ceil(np.max(np.abs(field)))) + 1
    for top in range(0, cells.shape[0], BLOCK):
        for left in range(0, cells.shape[1], BLOCK):
            _fetch_block(cells, field, node, row0, col0, out, (top, left, reach))
    for r in range(cells.shape[0]):
        for c in range(cells.shape[1]):
            if cells[r, c] >= OCCUPIED:
                _push_wall(cells, field, node, row0, col0, out, (r, c))


@njit(cache=True, nogil=True)
def _fetch_block(
    cells: NDArray[np.int8], field: NDArray[np.float32], node: int, row0: int, col0: int, out: NDArray[np.int8],
    block: tuple[int, int, int],
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Write one block of ``out``, each cell from where it came; most blocks of a map are unknown and stay so."""
    height, width = cells.shape
    top, left, reach = block
    bottom, right = min(top + BLOCK, height), min(left + BLOCK, width)
    known = False
    for r in range(max(top - reach, 0), min(bottom + reach, height)):
        for c in range(max(left - reach, 0), min(right + reach, width)):
            known = known or cells[r, c] >= 0
    for r in range(top, bottom):
        for c in range(left, right):
            out[r, c] = -1
            if known:
                x, y = c + 0.5, r + 0.5
                dx, dy = displaced(field, node, row0, col0, x, y)
                # Inverse of the displacement by one fixed-point step: enough, for the field changes by a few per cent.
                dx, dy = displaced(field, node, row0, col0, x - dx, y - dy)
                i, j = int(math.floor(y - dy)), int(math.floor(x - dx))
                if 0 <= i < height and 0 <= j < width:
                    out[r, c] = cells[i, j]


@njit(cache=True, nogil=True)
def _push_wall(
    cells: NDArray[np.int8], field: NDArray[np.float32], node: int, row0: int, col0: int, out: NDArray[np.int8],
    at: tuple[int, int],
) -> None:  # pragma: no cover - compiled  # fmt: skip
    """Draw one wall cell where it is moved to, and what joins it to the wall cells above and to the right of it."""
    r, c = at
    dx, dy = displaced(field, node, row0, col0, c + 0.5, r + 0.5)
    x, y = c + 0.5 + dx, r + 0.5 + dy
    _put(out, x, y, cells[r, c])
    for k in range(2):
        i, j = (r, c + 1) if k == 0 else (r + 1, c)
        if i < cells.shape[0] and j < cells.shape[1] and cells[i, j] >= OCCUPIED:
            ex, ey = displaced(field, node, row0, col0, j + 0.5, i + 0.5)
            _put(out, 0.5 * (x + j + 0.5 + ex), 0.5 * (y + i + 0.5 + ey), min(cells[r, c], cells[i, j]))


@njit(cache=True, nogil=True)
def _put(out: NDArray[np.int8], x: float, y: float, value: int) -> None:  # pragma: no cover - compiled
    r, c = int(math.floor(y)), int(math.floor(x))
    if 0 <= r < out.shape[0] and 0 <= c < out.shape[1] and out[r, c] < value:
        out[r, c] = value
