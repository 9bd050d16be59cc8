"""Straight walls as a compass: buildings have few directions, and a map that turns away from them drifts.

A scan matched to the map just drawn has its heading in that map to a hundredth of a degree, and the map itself turns, a
little with each metre. Walls far apart in a building are parallel, or square to each other, nearly always; so
the directions in which walls run are landmarks that are seen nearly everywhere. None is assumed: the first ones seen
become landmarks, others later on, and a place without straight walls changes nothing. Orthogonal SLAM (Nguyen, Harati,
Martinelli, Siegwart and Tomatis 2006) takes right angles for granted.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.filter.straight_walls import STRETCH_COLUMNS, STRETCHES_MOST, folded, main_direction, stretches
from mrslam.rbpf.loops.headings import Headings
from mrslam.rbpf.rows import Rows

WALL_RAD = math.radians(0.35)
"""Error of one scan's walls as a measure of the building's (1 sigma): real ones are parallel to a third of a degree."""
SAME_WALLS = 5.0
"""Number of keyframes that see the same walls with the same error: each counts as a share of one."""
DRIFT_RAD2_PER_M = math.radians(0.14) ** 2
"""Variance of the map's heading that comes with each metre of way, rad^2/m."""
SURPRISE_MEMORY, SURPRISE_LEAST = 0.05, 0.25
"""Share of a new reading in the squared error of readings over the expected one, and the least value of that: where
walls are less parallel than elsewhere, each counts less."""
OPEN_M = 6.5
"""Walls round an open place are no compass, metres of a scan's mean range: buildings differ by 1.4 degrees, and
walls seen from afar keep the map straight themselves. Measured: 4.7 in nine of ten scans indoors, 8.9 outdoors."""
GATE = 3.0
"""A direction is recognised within this number of sigmas."""
SURE = 0.9
"""Where a reading may be of more than one direction, one of them must have this share of the likelihood."""
MOST = 8
"""Most directions that are remembered: buildings have two or three, modulo a right angle."""
SAME_RAD = math.radians(0.7)
"""Directions that lie nearer to each other than this after a relaxation are one: two sigmas of one scan's walls."""
BENT_RAD = math.radians(0.2)
"""Error of heading and directions after a relaxation (1 sigma)."""
NONE = -1.0
"""Stands for the index of a direction where a keyframe saw none; a float, as in the table of keyframes."""
NOTHING = (0.0, NONE, 1.0)
"""Row of a keyframe that saw no direction."""


class WallDirections:
    """Kalman filter over the heading's error and the directions of walls in the map."""

    def __init__(self) -> None:
        self.angles = np.zeros(0)
        """``(D,)``, radians in the map, modulo a right angle."""
        self.seen = np.zeros(0, dtype=np.int64)
        """``(D,)``, how often each was seen."""
        self.cov = np.zeros((1, 1))
        """``(1 + D, 1 + D)``, rad^2, of the newest heading and of the directions."""
        self._seen_by_key = Rows(3)  # by keyframe: direction of its walls in its frame, index or -1, variance
        self._surprise = 1.0  # squared error of readings over the expected one
        self._walls = np.zeros((STRETCHES_MOST, STRETCH_COLUMNS))

    def turn(self, points: NDArray[np.float64], origin: NDArray[np.float64], heading: float, way_m: float) -> float:
        """Update the filter by a keyframe; return the angle that its heading should be corrected by, radians.

        ``points (N, 5)`` seen from ``origin (2,)``, both in the base frame; ``heading`` (rad) where the filter has it
        in the map, ``way_m`` since the keyframe before. With ``a`` the walls' direction in the base frame, ``d`` the
        same in the map and ``b`` the heading's error, ``d - heading - a`` measures ``b`` less the error of ``d``.
        """
        self.cov[0, 0] += DRIFT_RAD2_PER_M * way_m
        reading = main_direction(self._walls[: stretches(points, origin, self._walls)])
        if reading is None or np.hypot(*(points[:, :2] - origin).T).mean() > OPEN_M:
            self._seen_by_key.add(NOTHING)
            return 0.0
        direction, variance = reading
        variance += WALL_RAD**2
        missed = folded(self.angles - heading - direction)
        from_each = self.cov[0] - self.cov[1:]  # (D, 1 + D): covariance of each innovation with the state
        sigma2 = from_each[:, 0] - np.diagonal(from_each, 1) + variance
        near = missed**2 < GATE**2 * sigma2
        if not near.any():
            self._seen_by_key.add((direction, self._begin(heading + direction, variance), variance))
            return 0.0
        likely = np.where(near, self.seen * np.exp(-0.5 * missed**2 / sigma2) / np.sqrt(sigma2), 0.0)
        one = int(np.argmax(likely))
        if likely[one] < SURE * likely.sum():
            self._seen_by_key.add(NOTHING)
            return 0.0
        self._surprise += SURPRISE_MEMORY * (float(missed[one] ** 2 / sigma2[one]) - self._surprise)
        doubt = SAME_WALLS * max(self._surprise, SURPRISE_LEAST) - 1.0
        gain = from_each[one] / (sigma2[one] + doubt * variance)
        self.cov = self.cov - np.outer(gain, from_each[one])
        self.angles = self.angles + gain[1:] * missed[one]
        self.seen[one] += 1
        self._seen_by_key.add((direction, one, variance))
        return float(gain[0] * missed[one])

    def readings(self) -> Headings:
        """Return what keyframes say of their headings, as surely as they agreed so far."""
        direction, index, variance = self._seen_by_key.rows.T
        keys = np.flatnonzero(index >= 0.0)
        which = index[keys].astype(np.int64)
        return Headings(self.angles.copy(), keys, which, direction[keys], SAME_WALLS * self._surprise * variance[keys])

    def pass_over(self) -> None:
        """Learn nothing from a keyframe whose heading in the map nobody knows."""
        self._seen_by_key.add(NOTHING)

    def _begin(self, angle: float, variance: float) -> int:
        """Remember a new direction, where there are too many in place of the one seen least; return its index."""
        n = self.angles.size
        if n < MOST:
            self.angles, self.seen = np.append(self.angles, 0.0), np.append(self.seen, 0)
            self.cov = np.pad(self.cov, (0, 1))
        else:
            n = int(np.argmin(self.seen))
            gone = self._seen_by_key.rows[:, 1] == n
            self._seen_by_key.rows[gone] = NOTHING
        self.angles[n], self.seen[n] = angle, 1
        self.cov[n + 1] = self.cov[:, n + 1] = self.cov[0]
        self.cov[n + 1, n + 1] = self.cov[0, 0] + SAME_WALLS * variance
        return n

    def adopt(self, headings: NDArray[np.float64]) -> None:
        """Learn the directions again on a relaxed trajectory, from the ``headings (K,)`` of all keyframes."""
        direction, before, _ = self._seen_by_key.rows.T
        in_map, now = headings + direction, np.full(before.size, NONE)
        kept: list[float] = []
        for one in np.argsort(-self.seen, kind="stable"):
            saw = before == one
            angle = self.angles[one] + np.median(folded(in_map[saw] - self.angles[one]))
            same = np.flatnonzero(np.abs(folded(np.array(kept) - angle)) < SAME_RAD)
            now[saw] = same[0] if same.size else len(kept)
            kept += [] if same.size else [angle]
        self._seen_by_key.rows[:, 1] = now
        self.angles = np.array(kept)
        self.seen = np.bincount(now[now >= 0.0].astype(np.int64), minlength=len(kept))
        self.cov = np.diag(np.full(1 + len(kept), BENT_RAD**2))

    def state(self) -> list[Any]:
        """Return everything that a resumed mapper needs."""
        return [self.angles, self.seen.copy(), self.cov.copy(), self._surprise, self._seen_by_key.rows]

    def restore(self, state: list[Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self.angles, self.seen, self.cov, self._surprise = state[:4]
        self._seen_by_key = Rows.of(state[4])
