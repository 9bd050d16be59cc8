"""Fusing cells. Evidence is kept in whole numbers, so that sums do not depend on their order."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

NOTHING = -(1 << 31)
"""Evidence of a cell nobody has seen."""


@njit(cache=True, nogil=True)
def combine(
    one: NDArray[np.int32], two: NDArray[np.int32], by_max: bool, out: NDArray[np.int32]
) -> None:  # pragma: no cover - compiled
    """Write the evidence of both, ``(H, W) int32``: sum or maximum; where one saw nothing the other decides."""
    for i in range(one.shape[0]):
        for j in range(one.shape[1]):
            a, b = one[i, j], two[i, j]
            if a == NOTHING or b == NOTHING or by_max:
                out[i, j] = max(a, b)
            else:
                out[i, j] = a + b
