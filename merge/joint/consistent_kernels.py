"""Sets of matches that all agree with each other, grown one by one."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True, nogil=True)
def grow(agrees: NDArray[np.int8], start: int) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return a clique of ``agrees (M, M)``, 0 or 1 and symmetric, from one of its members on.

    The next member is the one that leaves most to choose from, the first of equals.
    """
    count = len(agrees)
    left = agrees[start].copy()
    left[start] = 0
    leaves = np.zeros(count, dtype=np.int32)  # of those left, how many each agrees with
    for other in range(count):
        if left[other]:
            for k in range(count):
                leaves[k] += agrees[other, k]
    clique, size = np.empty(count, dtype=np.int64), 1
    clique[0] = start
    while True:
        member, most = -1, -1
        for k in range(count):
            if left[k] and leaves[k] > most:
                member, most = k, leaves[k]
        if member < 0:
            return clique[:size]
        clique[size], size = member, size + 1
        for other in range(count):
            if left[other] and (other == member or not agrees[member, other]):
                left[other] = 0
                for k in range(count):
                    leaves[k] -= agrees[other, k]
