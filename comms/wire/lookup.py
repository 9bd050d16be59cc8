"""Kernels that map every cell by a table of 256 entries."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def mark_present(cells: NDArray[np.uint8], present: NDArray[np.bool_]) -> None:  # pragma: no cover - compiled
    """Set ``present (256,)`` at each byte that occurs in ``cells (N, 64, 64)``."""
    flat = cells.reshape(-1)
    for i in range(flat.size):
        present[flat[i]] = True


@njit(cache=True, nogil=True)
def look_up(
    table: NDArray[np.uint8], cells: NDArray[np.uint8], out: NDArray[np.uint8]
) -> int:  # pragma: no cover - compiled
    """Write ``table (256,)`` at each cell to ``out`` of the same shape, and return the greatest value of ``cells``."""
    source, target = cells.reshape(-1), out.reshape(-1)
    greatest = 0
    for i in range(source.size):
        greatest = max(greatest, int(source[i]))
        target[i] = table[source[i]]
    return greatest
