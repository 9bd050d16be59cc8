"""Which cells a beam passes through (Amanatides and Woo 1987)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

NEVER = 1e30
"""Stands for a time that does not come: the beam runs along the other axis."""


@njit(cache=True, nogil=True)
def along_axis(start: float, way: float, cell: int) -> tuple[int, float, float]:  # pragma: no cover - compiled
    """Return, for one axis: the step from cell to cell, when the first edge is passed, and the time from edge to edge.

    A beam is at ``start``, in ``cell``, at time 0, and ``way`` further at time 1.
    """
    step = 1 if way > 0 else -1
    if abs(way) <= 1e-12:
        return step, NEVER, NEVER
    between = 1.0 / abs(way)
    return step, ((cell + 1 - start) if way > 0 else (start - cell)) * between, between


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
    step_col, t_col, dt_col = along_axis(x0, x1 - x0, col)
    step_row, t_row, dt_row = along_axis(y0, y1 - y0, row)
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
