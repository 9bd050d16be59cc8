"""How goals have been approached so far, so that one that cannot be reached is given up in the end."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ARRIVED_M = 0.4
"""At a goal this near there is nothing more to drive, only to look."""
PROGRESS_M = 0.2
"""A goal that came this much nearer has made progress."""


@dataclass(eq=False)
class Attempt:
    """How a goal has been approached, over all times it was chosen: two goals taken in turns both run out of time."""

    nearest_m: float = math.inf
    spent_s: float = 0.0
    passed_over_until_ns: int = 0

    def spend(self, seconds: float, way_m: float) -> float:
        """Return how long it has been chosen without coming nearer; standing at it counts threefold."""
        if way_m < self.nearest_m - PROGRESS_M:
            self.nearest_m, self.spent_s = way_m, 0.0
        else:
            self.spent_s += seconds * (3.0 if way_m < ARRIVED_M else 1.0)
        return self.spent_s


class Attempts:
    """One for every place that was a goal; places nearer together than ``radius_m`` are one."""

    def __init__(self, radius_m: float) -> None:
        """Start with none."""
        self._radius_m = radius_m
        self._all: list[Attempt] = []
        self._at_m = np.empty((0, 2))

    def at(self, xy_m: NDArray[np.float64]) -> Attempt:
        """Return the attempt at a place ``(2,)``, a new one where there was none."""
        near = np.flatnonzero(np.hypot(*(self._at_m - xy_m).T) < self._radius_m)
        if near.size:
            return self._all[near[0]]
        self._all.append(Attempt())
        self._at_m = np.vstack([self._at_m, xy_m])
        return self._all[-1]

    def clear(self) -> None:
        """Forget all of them."""
        self._all.clear()
        self._at_m = np.empty((0, 2))
