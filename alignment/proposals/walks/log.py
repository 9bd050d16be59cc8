"""What every search of a least dissimilarity shares: its signature, and the record of what it tried."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

F64 = NDArray[np.float64]
Objective = Callable[[F64], float]
"""Dissimilarity of a sample ``(3,)``: x, y, metres; theta, radians."""
Search = Callable[[Objective, F64, F64, F64, int, np.random.Generator], F64]
"""``(objective, start, low, high, evaluations, rng) -> visited``: ``(N, 4)`` rows of x, y, theta, value in the order in
which they were evaluated, N <= evaluations."""


class Log:
    """Evaluates samples within bounds, counts the evaluations left and records what was visited."""

    def __init__(self, objective: Objective, low: F64, high: F64, evaluations: int) -> None:
        """``low``, ``high``: ``(3,)`` bounds of the samples."""
        self.objective, self.low, self.high, self.left = objective, low, high, evaluations
        self._rows: list[tuple[float, float, float, float]] = []

    def __call__(self, s: F64) -> float:
        """Evaluate a sample, clipped to the bounds."""
        s = self.clip(s)
        value = self.objective(s)
        self.left -= 1
        self._rows.append((float(s[0]), float(s[1]), float(s[2]), value))
        return value

    def clip(self, s: F64) -> F64:
        """Return the sample within the bounds, its angle in the full turn that begins at the lower one."""
        s = np.clip(s, self.low, self.high)
        s[2] = self.low[2] + (s[2] - self.low[2]) % (2.0 * math.pi)
        return s

    def visited(self) -> F64:
        """Return ``(N, 4)``, see ``Search``."""
        return np.array(self._rows).reshape(-1, 4)
