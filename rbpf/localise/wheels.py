"""Where wheels contradict what a saved map shows: matches that fit in part may be of another place."""

from __future__ import annotations

import math

import numpy as np

from mrslam.rbpf.front_end.prediction import DISBELIEVED, LEARN_INLIERS, Predictor, can_move
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.poses import compose
from mrslam.spatial.se2 import Transform

STRETCH_M, STRETCH_RAD = 1.0, 0.6
"""Motion over which matches are compared with wheels, metres and radians: single matches that fit in part are off by
decimetres either way."""


class WheelsCheck:
    """Compares matches with wheels that proved right, for as long as matches fit in part only.

    At the right place, where furniture has moved, both say that the robot moves; at a wrong one it seems to stand, for
    nothing that it passes is there. Where a scan fits well, it is the wheels that are wrong.
    """

    def __init__(self) -> None:
        """Start without motion."""
        self._told, self._matched = np.zeros(3), np.zeros(3)

    def follow(
        self, matched: Transform, odom_motion: Transform | None, elapsed_s: float, found: Match, predictor: Predictor
    ) -> bool:
        """Take the motion ``(3,)`` to a new scan as matched and as wheels told it; return whether they disagree."""
        fits = found.inliers >= LEARN_INLIERS * (found.inliers + found.conflicts)
        if odom_motion is None or fits or not _may_be_believed(odom_motion, elapsed_s, predictor):
            self._begin()
            return False
        self._told = compose(self._told, predictor.odometry.corrected(odom_motion))
        self._matched = compose(self._matched, matched)
        told, way_m, turn_rad = self._told, *_lengths(self._told, self._matched)
        missed_m = math.hypot(told[0] - self._matched[0], told[1] - self._matched[1])
        missed_rad = abs(math.remainder(told[2] - self._matched[2], 2.0 * math.pi))
        if way_m <= STRETCH_M and turn_rad <= STRETCH_RAD:
            return False
        self._begin()
        return missed_m > DISBELIEVED * max(way_m, STRETCH_M) or missed_rad > DISBELIEVED * max(turn_rad, STRETCH_RAD)

    def _begin(self) -> None:
        self._told, self._matched = np.zeros(3), np.zeros(3)


def _may_be_believed(odom_motion: Transform, elapsed_s: float, predictor: Predictor) -> bool:
    odometry = predictor.odometry
    is_right = not odometry.is_dead and odometry.slip < DISBELIEVED
    return is_right and not predictor.is_after_pause and can_move(odom_motion, elapsed_s)


def _lengths(*motions: Transform) -> tuple[float, float]:
    """Return the longest way of several motions ``(3,)``, and the largest turn."""
    return max(math.hypot(one[0], one[1]) for one in motions), max(abs(float(one[2])) for one in motions)
