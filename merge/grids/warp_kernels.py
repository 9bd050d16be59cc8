"""Rewriting a window of a rotated grid, cell by cell: free space is sampled, walls are drawn on it."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.merge.grids.wall_kernels import DRAWS_THIN, OCCUPIED, draw_wall, is_thick

MOST_SAMPLES = 8
"""Most samples of a target cell along each axis: bounds the work where the target is much coarser than the source."""


@njit(cache=True, nogil=True)
def _beside(cells: NDArray[np.int8], r: int, c: int, fx: float, fy: float) -> int:  # pragma: no cover - compiled
    """Return the value beside a thin wall cell, on the side of (fx, fy), cells from its centre; -1 off the grid.

    The four neighbours are tried nearest first; where all are walls the cell's own value is returned.
    """
    sx, sy = (1 if fx >= 0.0 else -1), (1 if fy >= 0.0 else -1)
    for k in range(4):
        side = sx if k < 2 else -sx
        other = sy if k < 2 else -sy
        if (k % 2 == 0) == (abs(fx) >= abs(fy)):
            rr, cc = r, c + side
        else:
            rr, cc = r + other, c
        if not (0 <= rr < cells.shape[0] and 0 <= cc < cells.shape[1]):
            return -1
        if cells[rr, cc] < OCCUPIED:
            return cells[rr, cc]
    return cells[r, c]


@njit(cache=True, nogil=True)
def sample(cells: NDArray[np.int8], sx: float, sy: float, draws_thin: bool) -> int:  # pragma: no cover - compiled
    """Return the value at a point (x, y) of the source in cells; of thin walls, that of the neighbour beside them."""
    c, r = int(math.floor(sx)), int(math.floor(sy))
    if not (0 <= r < cells.shape[0] and 0 <= c < cells.shape[1]):
        return -1
    value = cells[r, c]
    if value >= OCCUPIED and draws_thin and not is_thick(cells, r, c):
        return _beside(cells, r, c, sx - c - 0.5, sy - r - 0.5)
    return value


@njit(cache=True, nogil=True)
def _to_source(inverse: NDArray[np.float64], x: float, y: float) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the source point of a target point, both (x, y) in cells."""
    sx = inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2]
    sy = inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2]
    return sx, sy


@njit(cache=True, nogil=True)
def _average(
    cells: NDArray[np.int8], inverse: NDArray[np.float64], samples: int, row: int, col: int, draws_thin: bool
) -> int:  # pragma: no cover - compiled
    """Return the mean of ``samples`` x ``samples`` points of a target cell, rounded; half known is known.

    Walls are drawn afterwards, so that they win over free space.
    """
    known, total = 0, 0
    for k in range(samples * samples):
        x = col + (k % samples + 0.5) / samples
        y = row + (k // samples + 0.5) / samples
        sx, sy = _to_source(inverse, x, y)
        value = sample(cells, sx, sy, draws_thin)
        if value >= 0:
            known += 1
            total += value
    return (2 * total + known) // (2 * known) if 2 * known >= samples * samples and known > 0 else -1


@njit(cache=True, nogil=True)
def _sample_all(
    cells: NDArray[np.int8], inverse: NDArray[np.float64], draws_thin: bool, row0: int, col0: int, out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Write the value at the centre of every target cell; walls alone take the long way, which halves the time."""
    height, width = cells.shape
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            sx, sy = _to_source(inverse, col0 + j + 0.5, row0 + i + 0.5)
            c, r = int(math.floor(sx)), int(math.floor(sy))
            value = -1
            if 0 <= r < height and 0 <= c < width:
                value = cells[np.uint64(r), np.uint64(c)]
                if value >= OCCUPIED and draws_thin:
                    value = sample(cells, sx, sy, draws_thin)
            out[i, j] = value


@njit(cache=True, nogil=True)
def _reach(
    inverse: NDArray[np.float64], row0: int, col0: int, out: NDArray[np.int8], shape: tuple[int, int]
) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Return the rows and columns (from, to, from, to) of the source whose walls may be drawn in a window."""
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for k in range(4):
        x = col0 + (out.shape[1] if k % 2 else 0)
        y = row0 + (out.shape[0] if k // 2 else 0)
        sx, sy = _to_source(inverse, x, y)
        low_x, high_x, low_y, high_y = min(low_x, sx), max(high_x, sx), min(low_y, sy), max(high_y, sy)
    return (
        max(0, int(math.floor(low_y)) - 2), min(shape[0], int(math.ceil(high_y)) + 3),
        max(0, int(math.floor(low_x)) - 2), min(shape[1], int(math.ceil(high_x)) + 3),
    )  # fmt: skip


@njit(cache=True, nogil=True)
def warp_window(
    cells: NDArray[np.int8], inverse: NDArray[np.float64], ratio: float, row0: int, col0: int, out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Write what the window ``out`` of the target lattice, from lattice cell (row0, col0), shows of the source.

    ``inverse`` is ``(2, 3)``: source cell coordinates (x = column, y = row) of a target point in cells;
    ``ratio`` = target resolution / source resolution. A window's content does not depend on where it is cut.
    """
    draws_thin = ratio > DRAWS_THIN
    samples = max(1, min(MOST_SAMPLES, int(round(ratio))))
    if samples == 1:
        _sample_all(cells, inverse, draws_thin, row0, col0, out)
    else:
        for i in range(out.shape[0]):
            for j in range(out.shape[1]):
                out[i, j] = _average(cells, inverse, samples, row0 + i, col0 + j, draws_thin)
    r_from, r_to, c_from, c_to = _reach(inverse, row0, col0, out, cells.shape)
    for r in range(r_from, r_to):
        for c in range(c_from, c_to):
            if cells[r, c] >= OCCUPIED:
                draw_wall(cells, inverse, ratio, r, c, row0, col0, out)
