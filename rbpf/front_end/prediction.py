"""Prediction of the motion to the next scan: by odometry as far as it proved right, else by constant velocity.

Two guesses: odometry, corrected by what matching found wrong with it, and constant velocity. Matching shows how far
each can be believed, wherever the walls around leave no direction unseen. ``odom_motion`` is ``T_before_base`` as
odometry measured it, ``before`` being the base at the newest scan that was used.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np

from mrslam.rbpf.front_end.odometry import (
    LEAST_ERROR,
    LEAST_M,
    LEAST_RAD,
    MOST_ERROR,
    OdometryModel,
    has_moved,
    is_still,
)
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.se2 import Transform

MAX_STEP_M, MAX_SPEED_M_S = 5.0, 3.0
"""Odometry that jumps farther between two scans, and faster where no scan came for long, is disbelieved."""
PAUSE_MOST_M = 200.0
"""The same where it says to have come farther than this without a scan, however long that took: maps have to hold what
lies between."""
PAUSE_S, PAUSE_TIMES, INTERVAL_MEMORY = 2.0, 5.0, 0.1
"""No scan for this time, and for this multiple of the usual interval, is a pause: a robot that was off, a laser
unplugged. The velocity before it means nothing then, and odometry over it is no jump. The third is the share of a new
interval in the usual one."""
STEADY_S, MAX_TURN_RAD_S = 0.5, 6.0
"""Motion is thought to be steady over no longer than this, and no robot turns faster."""
LEARN = 0.05
"""Share of a new scan in the errors of both guesses: they follow a change within twenty scans."""
LEARN_INLIERS = 0.7
"""Nothing is learnt from a match with a smaller share of inliers."""
VELOCITY_DECAY = 0.8
"""Where a scan did not fit, its motion is not expected to continue, but the one before, and ever less of it."""
DISBELIEVED = 0.6
"""Odometry that is wrong by more than this share of the way does not say where the robot goes."""
JUMP_M, JUMP_RAD = 0.3, 0.3
"""Odometry that changes by more than this from one scan to the next may have jumped."""
ON_THE_SPOT_M = 0.01
"""A robot that is told to move less than this from one scan to the next turns on the spot, or stands, metres."""
APART_M, APART_RAD = 0.15, 0.15
"""Guesses farther apart than this lead to different matches."""
STEADY_SIGMA, STEADY_SHARE = 0.05, 0.5
"""Deviation of constant velocity, metres or radians: this, and this share of the motion."""
SIGMA_M, SIGMA_M_PER_RAD = 0.008, 0.02
"""Deviation of the position from scan to scan at rest, metres, and with each radian turned."""
SIGMA_RAD, SIGMA_RAD_PER_M = 0.005, 0.05
"""Deviation of the heading from scan to scan at rest, radians, and with each metre driven."""

ODOMETRY, VELOCITY = 0, 1
"""Rows of :attr:`Predictor.errors`."""


class Guess(NamedTuple):
    """A motion that may be expected."""

    motion: Transform
    """``(3,)``, base frame before it."""
    sigma_m: float
    """Standard deviation of x and of y from scan to scan, metres."""
    sigma_rad: float
    """Standard deviation of the turn from scan to scan, radians."""
    slip: float
    """Error for each metre of way, as it adds up over scans; ``sigma_m`` holds jitter, too, which does not add up."""


STOOD = Guess(np.zeros(3), 0.3, 0.6, 1.0)
"""After a pause: the robot is where it was, give or take a push (0.3 m) or a turn on the spot (0.6 rad)."""


class Predictor:
    """Predicts the motion from scan to scan, and how far off the prediction may be."""

    def __init__(self, odometry_noise: float) -> None:
        """Start with odometry that errs by this share of the motion."""
        self.odometry = OdometryModel(odometry_noise)
        self.velocity: Transform = np.zeros(3)
        """``(3,)``, the motion before, which may continue."""
        self.errors = np.array([[odometry_noise, odometry_noise], [0.5, 0.5]])
        """``(2, 2)``, from scan to scan: of odometry and of constant velocity, as shares of the way and of the turn."""
        self._odom_before = np.zeros(3)  # what odometry said at the scan before
        self._interval_s, self._pause_s = 0.0, 0.0

    def wait(self, elapsed_s: float) -> None:
        """Take how long ago the scan before was taken; called before each scan but the first."""
        is_pause = self.is_pause(elapsed_s)
        self._pause_s = elapsed_s if is_pause else 0.0
        if is_pause:  # what it did meanwhile is unknown
            self.velocity, self._odom_before = np.zeros(3), np.zeros(3)
            elapsed_s = PAUSE_TIMES * self._interval_s  # one long pause does not make others usual
        memory = INTERVAL_MEMORY if self._interval_s > 0.0 else 1.0
        self._interval_s += memory * (max(elapsed_s, 0.0) - self._interval_s)

    def is_pause(self, elapsed_s: float) -> bool:
        """Return whether scans that are so far apart have a pause between them."""
        return elapsed_s > max(PAUSE_S, PAUSE_TIMES * self._interval_s) and self._interval_s > 0.0

    @property
    def is_after_pause(self) -> bool:
        """Whether nothing was seen for long before this scan."""
        return self._pause_s > 0.0

    @property
    def was_moving(self) -> bool:
        """Whether the robot moved before this scan."""
        return has_moved(self.velocity)

    def says_it_stands(self, odom_motion: Transform | None) -> bool:
        """Return whether odometry says that the robot stands, and may be right."""
        return odom_motion is not None and not self.odometry.is_dead and is_still(odom_motion)

    def predict(self, odom_motion: Transform | None) -> Guess:
        """Return the motion to expect, given the one that odometry reports if there is some.

        Way and turn come from odometry or from constant velocity each, whichever erred less of late; the way comes from
        odometry in any case while its ``slip`` is below ``DISBELIEVED``.
        """
        if odom_motion is None or self._is_void(odom_motion):
            return self._steady()
        corrected = self.odometry.corrected(odom_motion)
        if self.is_after_pause:
            return self._guess(corrected, ODOMETRY, ODOMETRY)
        errors, trusted = self.errors, self.odometry.slip < DISBELIEVED
        way = ODOMETRY if trusted or errors[ODOMETRY, 0] <= errors[VELOCITY, 0] else VELOCITY
        turn = ODOMETRY if errors[ODOMETRY, 1] <= errors[VELOCITY, 1] else VELOCITY
        return self._guess(corrected, way, turn)

    def alternatives(self, odom_motion: Transform | None, predicted: Transform) -> list[Guess]:
        """Return other guesses, for where the one predicted fits badly or cannot be seen.

        They are what odometry says, if constant velocity was preferred to it, and constant velocity, if odometry may
        have jumped or stopped to count. After a pause it is no motion at all: wheels that counted on while the robot
        was off may say anything.
        """
        if odom_motion is None or self._is_void(odom_motion):
            return []
        corrected = self.odometry.corrected(odom_motion)
        if self.is_after_pause:
            return [STOOD] if are_apart(corrected, STOOD.motion) else []
        others = [self._guess(corrected, ODOMETRY, ODOMETRY)] if are_apart(corrected, predicted) else []
        may_be_wrong = self._has_jumped(odom_motion) or self.says_it_stands(odom_motion)
        return [*others, self._steady()] if may_be_wrong else others

    def dead_reckoned(self, odom_motion: Transform | None, silent_s: float = 0.0) -> Transform:
        """Return the motion ``(3,)`` since the newest scan that was used, as far as odometry alone can say.

        ``silent_s`` : how long ago that scan was taken, where :meth:`wait` does not know of it yet.
        """
        if odom_motion is None or self._is_void(odom_motion, silent_s):
            return np.zeros(3)
        return self.odometry.corrected(odom_motion)

    def speed(self, odom_motion: Transform | None, elapsed_s: float) -> Transform:
        """Return how fast the robot moves, ``(3,)`` m/s and rad/s in its own frame; zeros where that is a guess."""
        if not 0.0 < elapsed_s <= STEADY_S:
            return np.zeros(3)
        velocity = self.predict(odom_motion).motion / elapsed_s
        is_possible = math.hypot(velocity[0], velocity[1]) <= MAX_SPEED_M_S and abs(velocity[2]) <= MAX_TURN_RAD_S
        return velocity if is_possible else np.zeros(3)

    def learn(self, motion: Transform, odom_motion: Transform | None, found: Match, *, refuted: bool = False) -> None:
        """Learn how well each guess predicted the motion ``(3,)``, where the match is good enough for that.

        ``refuted`` : the scan fits a place that the prediction excluded.
        """
        is_good, is_seen = found.inliers >= LEARN_INLIERS, found.blind == 0.0
        if odom_motion is None or not is_good:
            self.odometry.begin_stretch()
        else:
            if refuted:
                self.odometry.refute()
            self.odometry.judge(motion, odom_motion, is_seen)
            self._judge(motion, odom_motion, is_seen)
        if self.is_after_pause:
            return
        if odom_motion is not None:
            self.odometry.watch_standing(motion, odom_motion, is_good)
        self.velocity = motion if is_good else VELOCITY_DECAY * self.velocity
        self._odom_before = np.zeros(3) if odom_motion is None else odom_motion

    def _judge(self, motion: Transform, odom_motion: Transform, is_seen: bool) -> None:
        """Learn the errors of both guesses from one scan."""
        length, turn = math.hypot(motion[0], motion[1]), abs(motion[2])
        for guess, errors in zip((self.odometry.corrected(odom_motion), self.velocity), self.errors, strict=True):
            if length > LEAST_M and is_seen:
                missed = math.hypot(guess[0] - motion[0], guess[1] - motion[1]) / length
                errors[0] = max(errors[0] + LEARN * (min(missed, MOST_ERROR) - errors[0]), LEAST_ERROR)
            if turn > LEAST_RAD:
                missed = abs(math.remainder(guess[2] - motion[2], 2.0 * math.pi)) / turn
                errors[1] = max(errors[1] + LEARN * (min(missed, MOST_ERROR) - errors[1]), LEAST_ERROR)

    def _is_void(self, odom_motion: Transform, silent_s: float = 0.0) -> bool:
        """Return whether odometry says nothing: impossibly far, or wheels that stopped counting."""
        most_m = max(MAX_STEP_M, min(MAX_SPEED_M_S * max(self._pause_s, silent_s), PAUSE_MOST_M))
        return not math.hypot(odom_motion[0], odom_motion[1]) <= most_m or (
            self.odometry.is_dead and is_still(odom_motion)
        )

    def _has_jumped(self, odom_motion: Transform) -> bool:
        before, way = self._odom_before, math.hypot(self._odom_before[0], self._odom_before[1])
        gap = math.hypot(odom_motion[0] - before[0], odom_motion[1] - before[1])
        turn = abs(math.remainder(odom_motion[2] - before[2], 2.0 * math.pi))
        return gap > max(JUMP_M, 2.0 * way) or turn > max(JUMP_RAD, 2.0 * abs(before[2]))

    def _steady(self) -> Guess:
        length, turn = math.hypot(self.velocity[0], self.velocity[1]), abs(self.velocity[2])
        return Guess(self.velocity, STEADY_SIGMA + STEADY_SHARE * length, STEADY_SIGMA + STEADY_SHARE * turn, 1.0)

    def _guess(self, corrected: Transform, way: int, turn: int) -> Guess:
        """Return a guess with way and turn from either source, ``ODOMETRY`` or ``VELOCITY``."""
        source = (corrected, self.velocity)
        motion = np.array([source[way][0], source[way][1], source[turn][2]])
        length, turned = math.hypot(motion[0], motion[1]), abs(motion[2])
        sigma_m = SIGMA_M + min(self.errors[way, 0], 1.0) * length + SIGMA_M_PER_RAD * turned
        sigma_rad = SIGMA_RAD + min(self.errors[turn, 1], 1.0) * turned + SIGMA_RAD_PER_M * length
        return Guess(motion, sigma_m, sigma_rad, min(self.odometry.slip, 1.0) if way == ODOMETRY else 1.0)

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed predictor needs."""
        return {
            "velocity": self.velocity, "errors": self.errors, "odometry": self.odometry.state(),
            "odom_before": self._odom_before, "interval_s": self._interval_s, "pause_s": self._pause_s,
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the predictor that was saved."""
        self.velocity, self.errors = state["velocity"], state["errors"]
        self.odometry.restore(state["odometry"])
        self._odom_before = state["odom_before"]
        self._interval_s, self._pause_s = state["interval_s"], state["pause_s"]


def are_apart(one: Transform, two: Transform) -> bool:
    """Return whether descents from two motions or poses ``(3,)`` lead to different matches."""
    turn = abs(math.remainder(one[2] - two[2], 2.0 * math.pi))
    return math.hypot(one[0] - two[0], one[1] - two[1]) > APART_M or turn > APART_RAD


def can_move(motion: Transform, elapsed_s: float) -> bool:
    """Return whether a robot can move so ``(3,)`` in this time, whose ends may be told a little late or early."""
    time_s = max(elapsed_s, 0.0)
    way_m, turn_rad = math.hypot(motion[0], motion[1]), abs(motion[2])
    return way_m <= JUMP_M + MAX_SPEED_M_S * time_s and turn_rad <= JUMP_RAD + MAX_TURN_RAD_S * time_s


def has_leapt(predicted: Transform, motion: Transform) -> bool:
    """Return whether a motion ``(3,)`` is far from the one that was predicted.

    Half as far where the robot was to stand; of one that was to turn on the spot, half as far in position.
    """
    away_m = math.hypot(predicted[0] - motion[0], predicted[1] - motion[1])
    turned_away = abs(math.remainder(predicted[2] - motion[2], 2.0 * math.pi))
    limit_m = JUMP_M if math.hypot(predicted[0], predicted[1]) > ON_THE_SPOT_M else JUMP_M / 2.0
    limit_rad = JUMP_RAD / 2.0 if is_still(predicted) else JUMP_RAD
    return math.hypot(away_m / limit_m, turned_away / limit_rad) > 1.0
