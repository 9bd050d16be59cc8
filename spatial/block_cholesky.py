"""Sparse Cholesky factors whose elements are 3 x 3 blocks: of a pose graph, one block row a pose.

Up-looking, with the rows of every column known beforehand (Davis 2006, chapter 4, sections 1, 2 and 7).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class FillIn(NamedTuple):
    """Where a factor has blocks below its diagonal, B of them, counted by columns."""

    starts: NDArray[np.int64]
    """``(N + 1,)``: column ``i`` has blocks ``starts[i]`` to ``starts[i + 1]``,"""
    rows: NDArray[np.int64]
    """``(B,)``: in these rows, which rise."""
    line_starts: NDArray[np.int64]
    """``(N + 1,)``: row ``k`` has those that are in ``line`` from ``line_starts[k]`` to ``line_starts[k + 1]``,"""
    line: NDArray[np.int64]
    """``(B,)``: from left to right."""


@njit(cache=True, nogil=True)
def fill_in(row_starts: NDArray[np.int64], columns: NDArray[np.int64]) -> FillIn:  # pragma: no cover - compiled
    """Return which blocks the factor of a matrix has.

    Row ``k`` of the matrix has blocks in ``columns[row_starts[k] : row_starts[k + 1]]``, all left of the diagonal.
    """
    count = row_starts.size - 1
    parent, seen = np.full(count, -1), np.full(count, -1)
    starts, line_starts = np.zeros(count + 1, dtype=np.int64), np.zeros(count + 1, dtype=np.int64)
    for k in range(count):
        seen[k] = k
        for at in range(row_starts[k], row_starts[k + 1]):
            i = columns[at]
            while seen[i] != k:  # up the elimination tree
                if parent[i] < 0:
                    parent[i] = k
                seen[i] = k
                starts[i + 1] += 1
                line_starts[k + 1] += 1
                i = parent[i]
    starts, line_starts = np.cumsum(starts), np.cumsum(line_starts)
    rows, line = np.empty(starts[count], dtype=np.int64), np.empty(starts[count], dtype=np.int64)
    free = starts[:count].copy()
    seen[:] = -1
    for k in range(count):
        seen[k] = k
        for at in range(row_starts[k], row_starts[k + 1]):
            i = columns[at]
            while seen[i] != k:
                seen[i] = k
                rows[free[i]] = k
                free[i] += 1
                i = parent[i]
    free = line_starts[:count].copy()
    for block in range(rows.size):
        line[free[rows[block]]] = block
        free[rows[block]] += 1
    return FillIn(starts, rows, line_starts, line)


@njit(cache=True, nogil=True)
def factorise(
    diagonal: NDArray[np.float64],
    below: NDArray[np.float64],
    row_starts: NDArray[np.int64],
    columns: NDArray[np.int64],
    starts: NDArray[np.int64],
    rows: NDArray[np.int64],
    line_starts: NDArray[np.int64],
    line: NDArray[np.int64],
    least: float,
) -> NDArray[np.float64]:  # pragma: no cover - compiled
    """Return the factor's blocks ``(B, 3, 3)``, as :func:`fill_in` counts them; ``diagonal (N, 3, 3)`` becomes its own.

    ``below (M, 3, 3)`` : the matrix's blocks at ``row_starts`` and ``columns``. ``least`` : what was
    added to the diagonal of a matrix without negative eigenvalues; pivots are no less but by rounding.
    """
    count = diagonal.shape[0]
    blocks, x = np.empty((rows.size, 3, 3)), np.zeros((count, 3, 3))
    column = np.empty(rows.size, dtype=np.int64)
    for i in range(count):
        column[starts[i] : starts[i + 1]] = i
    for k in range(count):
        for at in range(row_starts[k], row_starts[k + 1]):
            x[columns[at]] = below[at]
        own = diagonal[k]
        for nth in range(line_starts[k], line_starts[k + 1]):
            block = line[nth]
            i = column[block]
            pivot, done, now = diagonal[i], blocks[block], x[i]
            for a in range(3):
                done[a, 0] = now[a, 0] / pivot[0, 0]
                done[a, 1] = (now[a, 1] - done[a, 0] * pivot[1, 0]) / pivot[1, 1]
                done[a, 2] = (now[a, 2] - done[a, 0] * pivot[2, 0] - done[a, 1] * pivot[2, 1]) / pivot[2, 2]
                now[a, 0] = now[a, 1] = now[a, 2] = 0.0
            for p in range(starts[i], block):
                other, sum_ = blocks[p], x[rows[p]]
                for a in range(3):
                    for b in range(3):
                        sum_[a, b] -= done[a, 0] * other[b, 0] + done[a, 1] * other[b, 1] + done[a, 2] * other[b, 2]
            for a in range(3):
                for b in range(a + 1):
                    own[a, b] -= done[a, 0] * done[b, 0] + done[a, 1] * done[b, 1] + done[a, 2] * done[b, 2]
        own[0, 0] = math.sqrt(max(own[0, 0], least))
        own[1, 0] /= own[0, 0]
        own[2, 0] /= own[0, 0]
        own[1, 1] = math.sqrt(max(own[1, 1] - own[1, 0] ** 2, least))
        own[2, 1] = (own[2, 1] - own[2, 0] * own[1, 0]) / own[1, 1]
        own[2, 2] = math.sqrt(max(own[2, 2] - own[2, 0] ** 2 - own[2, 1] ** 2, least))
        own[0, 1] = own[0, 2] = own[1, 2] = 0.0
    return blocks


@njit(cache=True, nogil=True)
def solve(
    diagonal: NDArray[np.float64],
    blocks: NDArray[np.float64],
    starts: NDArray[np.int64],
    rows: NDArray[np.int64],
    x: NDArray[np.float64],
) -> None:  # pragma: no cover - compiled
    """Solve for the right side ``x (N, 3)``, in place, with the factor that :func:`factorise` made."""
    count = diagonal.shape[0]
    for i in range(count):
        pivot, own = diagonal[i], x[i]
        own[0] = own[0] / pivot[0, 0]
        own[1] = (own[1] - pivot[1, 0] * own[0]) / pivot[1, 1]
        own[2] = (own[2] - pivot[2, 0] * own[0] - pivot[2, 1] * own[1]) / pivot[2, 2]
        for p in range(starts[i], starts[i + 1]):
            block, other = blocks[p], x[rows[p]]
            for a in range(3):
                other[a] -= block[a, 0] * own[0] + block[a, 1] * own[1] + block[a, 2] * own[2]
    for i in range(count - 1, -1, -1):
        pivot, own = diagonal[i], x[i]
        for p in range(starts[i], starts[i + 1]):
            block, other = blocks[p], x[rows[p]]
            for a in range(3):
                own[a] -= block[0, a] * other[0] + block[1, a] * other[1] + block[2, a] * other[2]
        own[2] = own[2] / pivot[2, 2]
        own[1] = (own[1] - pivot[2, 1] * own[2]) / pivot[1, 1]
        own[0] = (own[0] - pivot[1, 0] * own[1] - pivot[2, 0] * own[2]) / pivot[0, 0]
