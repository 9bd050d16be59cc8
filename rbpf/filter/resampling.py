"""Weights, the effective number of particles, and systematic resampling."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def systematic(weights: NDArray[np.float64], count: int, u: float) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return ``count`` ancestors by systematic resampling with one draw ``u`` in [0, 1) (Carpenter et al. 1999).

    The walk along the cumulated weights stops at the last particle of positive weight, so that sums that fall short of
    1 do no harm. Weights need not be normalised; where all are zero, particles survive in turn.
    """
    n = weights.size
    parents = np.arange(count) % n
    total = 0.0
    last = 0
    for i in range(n):
        total += weights[i]
        if weights[i] > 0.0:
            last = i
    if not total > 0.0:
        return parents
    i, cumulated = 0, weights[0]
    for k in range(count):
        target = (k + u) / count * total
        while cumulated <= target and i < last:
            i += 1
            cumulated += weights[i]
        parents[k] = i
    return parents


def normalised(log_weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``(N,)`` weights that sum to 1, from log weights of any size; equal ones where none is finite."""
    finite = np.isfinite(log_weights)
    if not finite.any():
        return np.full(log_weights.size, 1.0 / log_weights.size)
    top = log_weights[finite].max()
    weights = np.where(finite, np.exp(np.where(finite, log_weights, top) - top), 0.0)
    return weights / weights.sum()


def effective(weights: NDArray[np.float64]) -> float:
    """Return Neff = 1 / sum w^2 of normalised weights, the number of particles that matter."""
    return float(1.0 / np.square(weights).sum())
