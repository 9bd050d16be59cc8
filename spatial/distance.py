"""Distance transforms in linear time."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

FAR = 1.0e9
"""Distance where the mask holds no cell at all, cells."""


@njit(cache=True, nogil=True)
def _along_columns(mask: NDArray[np.bool_]) -> NDArray[np.float32]:  # pragma: no cover - compiled
    """Return the distance of every cell to the nearest true cell of its column, in cells."""
    height, width = mask.shape
    column = np.empty((height, width), dtype=np.float32)
    far, one = np.float32(FAR), np.float32(1.0)
    for r in range(height):  # row by row, as they lie in memory
        for c in range(width):
            above = column[r - 1, c] if r > 0 else far
            column[r, c] = 0.0 if mask[r, c] else above + one
    for r in range(height - 2, -1, -1):
        for c in range(width):
            column[r, c] = min(column[r, c], column[r + 1, c] + one)
    return column


@njit(cache=True, nogil=True)
def euclidean(mask: NDArray[np.bool_], most: float = FAR) -> NDArray[np.float32]:  # pragma: no cover - compiled
    """Return the distance of every cell to the nearest true cell, in cells (Felzenszwalb and Huttenlocher 2012).

    Those that are farther than ``most`` from any are ``FAR``, for which less is to do.
    """
    height, width = mask.shape
    column = _along_columns(mask)
    out = np.empty((height, width), dtype=np.float32)
    apex = np.empty(width, dtype=np.int64)
    bound = np.empty(width + 1, dtype=np.float64)
    for r in range(height):
        k = -1
        for c in range(width):
            if column[r, c] > most or column[r, c] >= FAR:
                continue
            f = float(column[r, c]) ** 2 + float(c) ** 2
            cut = -math.inf
            while k >= 0:
                other = apex[k]
                cut = (f - float(column[r, other]) ** 2 - float(other) ** 2) / (2.0 * (c - other))
                if cut > bound[k]:
                    break
                k -= 1
            k += 1
            apex[k] = c
            bound[k] = cut if k > 0 else -math.inf
            bound[k + 1] = math.inf
        if k < 0:
            out[r, :] = FAR
            continue
        j = 0
        for c in range(width):
            while bound[j + 1] < c:
                j += 1
            away = math.sqrt(float(column[r, apex[j]]) ** 2 + float(c - apex[j]) ** 2)
            out[r, c] = away if away <= most else FAR
    return out


@njit(cache=True, nogil=True)
def manhattan(mask: NDArray[np.bool_]) -> NDArray[np.int32]:  # pragma: no cover - compiled
    """Return the Manhattan distance of every cell to the nearest true cell, in cells, by two relaxation passes.

    Carpin, Birk and Jucikas 2005, section 3. Without any true cell all are ``height + width``.
    """
    height, width = mask.shape
    far = height + width
    out = np.empty((height, width), dtype=np.int32)
    for r in range(height):
        for c in range(width):
            near = 0 if mask[r, c] else far
            if r > 0:
                near = min(near, out[r - 1, c] + 1)
            if c > 0:
                near = min(near, out[r, c - 1] + 1)
            out[r, c] = near
    for r in range(height - 1, -1, -1):
        for c in range(width - 1, -1, -1):
            near = out[r, c]
            if r < height - 1:
                near = min(near, out[r + 1, c] + 1)
            if c < width - 1:
                near = min(near, out[r, c + 1] + 1)
            out[r, c] = near
    return out
