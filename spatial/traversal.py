"""Which cells a beam passes through (Amanatides and Woo 1987)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def traverse(
    x0: float, y0: float, x1: float, y1: float, rows: NDArray[np.int32], cols: NDArray[np.int32]
) -> int:  # pragma: no cover - compiled
    """Write the cells from point 0 to point 1 (both included), in order, and return how many.

    Coordinates are in cells (metres divided by the resolution); cell (row, col) holds ``floor(y), floor(x)``.
    Stops where ``rows`` is full: ``(N,) int32`` with N >= |d row| + |d col| + 1 holds every beam.
    """
    col, row = int(math.floor(x0)), int(math.floor(y0))
    col_end, row_end = int(math.floor(x1)), int(math.floor(y1))
    dx, dy = x1 - x0, y1 - y0
    step_col, step_row = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    t_col = t_row = dt_col = dt_row = math.inf
    if dx != 0.0:
        dt_col = 1.0 / abs(dx)
        t_col = ((col + 1 - x0) if dx > 0 else (x0 - col)) * dt_col
    if dy != 0.0:
        dt_row = 1.0 / abs(dy)
        t_row = ((row + 1 - y0) if dy > 0 else (y0 - row)) * dt_row
    count = min(abs(col_end - col) + abs(row_end - row) + 1, rows.size)
    for i in range(count):
        rows[i] = row
        cols[i] = col
        # The end cell is reached by construction; comparing to it guards against rounding at corners.
        if col != col_end and (t_col <= t_row or row == row_end):
            col += step_col
            t_col += dt_col
        else:
            row += step_row
            t_row += dt_row
    return count
