"""What matching has found wrong with the wheels' odometry: scale, veer, slip, and wheels that stopped counting."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from mrslam.spatial.poses import compose
from mrslam.spatial.se2 import Transform

STRETCH_M, STRETCH_RAD = 0.5, 0.5
"""Odometry is judged over stretches of this length, metres or radians: there, jitter from scan to scan averages out."""
LEARN_STRETCH = 0.1
"""Share of a new stretch in what is known of odometry: it follows a change of floor within ten stretches, 5 m."""
LEARN_VEER = 0.01
"""Least share of a stretch in the veer: in the end it is the mean over the last hundred, for one alone says little."""
VEER_MOST = 0.5
"""A stretch that veers off by more, rad/m, was no straight drive, and is left out."""
GAIN_RANGE = 1.5
"""Odometry's scale is thought to be off by at most this factor, either way."""
STRAIGHT = 0.8
"""Scale is learnt where both motions of a stretch point the same way: cosine of the angle between them."""
LEAST_ERROR, MOST_ERROR = 0.03, 3.0
"""Bounds of a relative error: odometry is never taken as exact, and one slip is not remembered for ever."""
STILL = 1e-3
"""Wheels that turned less than this, metres and radians, say that the robot stands."""
ORIGIN_M, ORIGIN_RAD, SET_BACK_M = 0.5, 0.3, 3.0
"""Odometry within the first two of its origin that was farther away than the third has begun again there, metres and
radians, unless the robot drove there, which its map shows."""
DEAD_SCANS = 5
"""Scans that moved while the wheels stood, after which odometry is dead until they turn again."""
LEAST_M, LEAST_RAD = 0.03, 0.03
"""Smaller motions, metres and radians, are within the matcher's noise: relative errors cannot be learnt from them."""


class OdometryModel:
    """Corrects odometry by what matching found over the last stretches of way."""

    def __init__(self, noise: float) -> None:
        """Start with odometry that errs by this share of the motion."""
        self.gains = np.ones(2)
        """``(2,)``, matched motion as a multiple of the reported: of the way, of the turn."""
        self.veer = 0.0
        """Turn that odometry misses with each metre of way, rad/m: wheels are not equally large."""
        self.slip = noise
        """Error of corrected odometry over a stretch, as a share of its way."""
        self.dead_scans = 0
        """Scans that moved while the wheels stood, since the wheels turned last."""
        self._veer_stretches = 0  # that the veer was learnt from
        # The stretch: motion as reported and as matched, and whether it was seen in every direction.
        self._reported, self._matched, self._is_seen = np.zeros(3), np.zeros(3), True

    def corrected(self, odom_motion: Transform) -> Transform:
        """Return the motion ``(3,)`` that odometry means, judging by what matching found so far."""
        gain, turn = self.gains
        turned = turn * odom_motion[2] + self.veer * _signed_way(odom_motion)
        return np.array([gain * odom_motion[0], gain * odom_motion[1], turned])

    @property
    def is_dead(self) -> bool:
        """Whether the wheels have stopped counting."""
        return self.dead_scans >= DEAD_SCANS

    def refute(self) -> None:
        """Raise ``slip``: a scan fits a place that odometry excluded."""
        self.slip += LEARN_STRETCH * (1.0 - self.slip)

    def watch_standing(self, motion: Transform, odom_motion: Transform, is_good: bool) -> None:
        """Count scans that moved while the wheels stood; ``is_good`` : whether the scan's match can be believed."""
        if not is_still(odom_motion):
            self.dead_scans = 0
        elif has_moved(motion):
            self.dead_scans += is_good
        elif not self.is_dead:
            self.dead_scans = max(self.dead_scans - 1, 0)

    def judge(self, motion: Transform, odom_motion: Transform, is_seen: bool) -> None:
        """Add one scan's motion, as matched and as reported, to the stretch, and learn from it once it is long enough.

        ``is_seen`` : whether the scan saw its motion in every direction.
        """
        self._reported, self._matched = compose(self._reported, odom_motion), compose(self._matched, motion)
        self._is_seen &= is_seen
        way, turn = math.hypot(self._matched[0], self._matched[1]), abs(self._matched[2])
        if way > STRETCH_M and self._is_seen:
            self._learn_way(way, turn)
        if turn > STRETCH_RAD and self._reported[2] * self._matched[2] > 0.0:
            self.gains[1] += LEARN_STRETCH * (_bounded(self._matched[2] / self._reported[2]) - self.gains[1])
        if way > STRETCH_M or turn > STRETCH_RAD:
            self.begin_stretch()

    def _learn_way(self, way: float, turn: float) -> None:
        reported, matched, gain = self._reported, self._matched, self.gains[0]
        missed = math.hypot(gain * reported[0] - matched[0], gain * reported[1] - matched[1]) / way
        self.slip += LEARN_STRETCH * (min(max(missed, LEAST_ERROR), MOST_ERROR) - self.slip)
        reported_m = math.hypot(reported[0], reported[1])
        if reported[0] * matched[0] + reported[1] * matched[1] > STRAIGHT * way * reported_m:
            self.gains[0] += LEARN_STRETCH * (_bounded(way / reported_m) - gain)
            if turn < STRETCH_RAD:
                self._learn_veer((matched[2] - self.gains[1] * reported[2]) / _signed_way(reported))

    def _learn_veer(self, veer: float) -> None:
        if abs(veer) < VEER_MOST:
            self._veer_stretches += 1
            self.veer += max(1.0 / (self._veer_stretches + 1), LEARN_VEER) * (veer - self.veer)

    def begin_stretch(self) -> None:
        """Begin another stretch, as where a scan's motion is not known."""
        self._reported, self._matched, self._is_seen = np.zeros(3), np.zeros(3), True

    def state(self) -> list[Any]:
        """Return everything that a resumed model needs."""
        stretch = [self._reported, self._matched, bool(self._is_seen)]
        return [self.gains, self.veer, self._veer_stretches, self.slip, int(self.dead_scans), stretch]

    def restore(self, state: list[Any]) -> None:
        """Become the model that was saved."""
        self.gains, self.veer, self._veer_stretches, self.slip, self.dead_scans, stretch = state
        self._reported, self._matched, self._is_seen = stretch


def has_been_set_back(T_before: Transform, T_now: Transform) -> bool:
    """Return whether odometry ``(3,)`` that was far from its origin is there again."""
    is_there = math.hypot(T_now[0], T_now[1]) < ORIGIN_M and abs(T_now[2]) < ORIGIN_RAD
    return is_there and math.hypot(T_before[0], T_before[1]) > SET_BACK_M


def is_still(motion: Transform) -> bool:
    """Return whether odometry ``(3,)`` says that the robot stood."""
    return math.hypot(motion[0], motion[1]) < STILL and abs(motion[2]) < STILL


def has_moved(motion: Transform) -> bool:
    """Return whether a matched motion ``(3,)`` is more than the matcher's noise."""
    return math.hypot(motion[0], motion[1]) > LEAST_M or abs(motion[2]) > LEAST_RAD


def _signed_way(motion: Transform) -> float:
    """Return the length of a motion, negative where it leads backward."""
    return math.copysign(math.hypot(motion[0], motion[1]), motion[0])


def _bounded(gain: float) -> float:
    return min(max(gain, 1.0 / GAIN_RANGE), GAIN_RANGE)
