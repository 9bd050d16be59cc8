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

    x_m: float
    y_m: float
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

    def at(self, xy_m: NDArray[np.float64]) -> Attempt:
        """Return the attempt at a place ``(2,)``, a new one where there was none."""
        x, y = xy_m.tolist()
        for attempt in self._all:
            if math.hypot(attempt.x_m - x, attempt.y_m - y) < self._radius_m:
                return attempt
        self._all.append(Attempt(x, y))
        return self._all[-1]

    def clear(self) -> None:
        """Forget all of them."""
        self._all.clear()
