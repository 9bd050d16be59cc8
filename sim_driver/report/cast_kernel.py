"""The kernel that notes when places were first seen along a scan's beams."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def see_along(
    seen_s: NDArray[np.float32],
    t_s: np.float32,
    start_m: NDArray[np.float64],
    cos: NDArray[np.float64],
    sin: NDArray[np.float64],
    reach_m: NDArray[np.float64],
    step_m: float,
    cell_m: float,
) -> None:
    """Lower the times ``seen_s (H, W)`` to ``t_s`` in all cells along beams from ``start_m (2,)``, their ends included.

    Beam n runs ``reach_m[n]`` metres in the direction ``cos[n], sin[n]`` and is sampled every ``step_m``; the cell in
    row r and column c is the square of ``cell_m`` at ``(c, r) * cell_m``. What falls outside is left out.
    """
    height, width = seen_s.shape
    for n in range(reach_m.size):
        k = 0
        while k * step_m <= reach_m[n] + step_m:
            along = min(k * step_m, reach_m[n])
            col = math.floor((start_m[0] + along * cos[n]) / cell_m)
            row = math.floor((start_m[1] + along * sin[n]) / cell_m)
            if 0 <= row < height and 0 <= col < width and t_s < seen_s[row, col]:
                seen_s[row, col] = t_s
            k += 1
