"""Single poses in the hot path: the same algebra as ``mrslam.spatial.se2``, without the cost of array programming."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def compose(ab: NDArray[np.float64], bc: NDArray[np.float64]) -> NDArray[np.float64]:  # pragma: no cover - compiled
    """Return ``T_a_c (3,)`` of ``T_a_b`` and ``T_b_c``."""
    c, s = math.cos(ab[2]), math.sin(ab[2])
    out = np.empty(3)
    out[0] = ab[0] + c * bc[0] - s * bc[1]
    out[1] = ab[1] + s * bc[0] + c * bc[1]
    theta = ab[2] + bc[2]
    out[2] = math.pi - (math.pi - theta) % (2.0 * math.pi)
    return out


@njit(cache=True, nogil=True)
def between(wa: NDArray[np.float64], wb: NDArray[np.float64]) -> NDArray[np.float64]:  # pragma: no cover - compiled
    """Return ``T_a_b (3,)`` of ``T_w_a`` and ``T_w_b``."""
    c, s = math.cos(wa[2]), math.sin(wa[2])
    dx, dy = wb[0] - wa[0], wb[1] - wa[1]
    out = np.empty(3)
    out[0] = c * dx + s * dy
    out[1] = -s * dx + c * dy
    theta = wb[2] - wa[2]
    out[2] = math.pi - (math.pi - theta) % (2.0 * math.pi)
    return out
