"""Scans of few beams, gathered along odometry until together they show enough to be matched.

A laser of 11 or 30 beams sees no surfaces, only spots; over a few decimetres of way its spots line the walls. They are
matched together as one virtual scan (as sparse-gslam does: Yang, Latif and Reid 2022), and all since the last keyframe
make up the next.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.matching.cloud import joined, transformed
from mrslam.spatial.poses import between
from mrslam.spatial.se2 import Transform

SPARSE = 45
"""A laser whose scans have fewer returns than this, on average, is sparse. Measured on intel: 60 beams need nothing, 30
do."""
RETURNS_MEMORY = 0.02
"""Share of a new scan in that average."""
ENOUGH = 90
"""Returns that are matched together: as many as other scans have, half of ``rbpf.beams_match``."""
WAY_MOST_M, TURN_MOST_RAD = 0.3, 0.2
"""They are matched earlier after this way or turn by odometry, whose errors blur them: by a centimetre at 3 %."""
SINCE_KEY_MOST = 100
"""Times that scans were matched whose points wait for the next keyframe, at most, the newest: a robot at rest makes no
keyframe for hours."""


class Gathering:
    """The newest scans that were not matched yet, and those since the last keyframe."""

    def __init__(self) -> None:
        self._returns: float | None = None
        self._waiting: list[tuple[Transform, NDArray[np.float64]]] = []  # T_odom_base (3,), points (N, 5)
        self._since_key: list[tuple[Transform, NDArray[np.float64]]] = []  # T_local_base (3,), points (N, 5)

    def count(self, returns: int) -> None:
        """Learn how many returns scans have."""
        before = returns if self._returns is None else self._returns
        self._returns = before + RETURNS_MEMORY * (returns - before)

    @property
    def is_sparse(self) -> bool:
        """Whether scans show too little each."""
        return self._returns is not None and self._returns < SPARSE

    def add(self, T_odom_base: Transform, points: NDArray[np.float64]) -> None:
        """Add a scan's ``points (N, 5)`` to those that wait; the oldest are forgotten where they lie too far back."""
        self._waiting.append((T_odom_base.copy(), points.copy()))
        while len(self._waiting) > 2 and _is_far(self._waiting[1][0], T_odom_base):
            del self._waiting[0]

    @property
    def returns(self) -> int:
        """Number of returns that wait."""
        return sum(len(part) for _, part in self._waiting)

    @property
    def is_enough(self) -> bool:
        """Whether those that wait are enough to be matched, or lie far enough apart."""
        return self.returns >= ENOUGH or _is_far(self._waiting[0][0], self._waiting[-1][0])

    def take(self, origin: NDArray[np.float64], corrected: Callable[[Transform], Transform]) -> NDArray[np.float64]:
        """Return the points ``(N, 5)`` of all that wait as one scan in the newest one's base frame, and forget them.

        ``origin (2,)`` : of the laser on the base. ``corrected`` : what a motion by odometry really is.
        """
        waiting, self._waiting = self._waiting, []
        newest = waiting[-1][0]
        parts = []
        for T_odom_base, points in waiting:
            motion = corrected(between(T_odom_base, newest))  # T_then_now
            parts.append(transformed(points, between(motion, np.zeros(3))))
        return joined(parts, origin)

    def drop(self) -> None:
        """Forget what waits: odometry to the next scan means nothing."""
        self._waiting.clear()

    def remember(self, T_local_base: Transform, points: NDArray[np.float64]) -> None:
        """Keep matched ``points (N, 5)`` for the next keyframe; ``T_local_base (3,)`` is where they were matched."""
        self._since_key = [*self._since_key[1 - SINCE_KEY_MOST :], (T_local_base.copy(), points.copy())]

    def of_key(self, T_local_base: Transform, origin: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return all points ``(N, 5)`` since the last keyframe as seen from this pose, and begin the next one."""
        parts = [transformed(points, between(T_local_base, then)) for then, points in self._since_key]
        self._since_key = []
        return joined(parts, origin)

    def state(self) -> list[Any]:
        """Return everything that a resumed mapper needs."""
        lists = ([[pose, points] for pose, points in part] for part in (self._waiting, self._since_key))
        return [self._returns, *lists]

    def restore(self, state: list[Any]) -> None:
        """Become the gathering that was saved."""
        self._returns = state[0]
        self._waiting, self._since_key = ([(pose, points) for pose, points in part] for part in state[1:])


def _is_far(one: Transform, two: Transform) -> bool:
    """Return whether two poses ``(3,)`` are too far apart for odometry to join their scans."""
    since = between(one, two)
    return math.hypot(since[0], since[1]) > WAY_MOST_M or abs(since[2]) > TURN_MOST_RAD
