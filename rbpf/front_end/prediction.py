"""What motion to expect before the scan is matched: from the wheels as far as they proved right, else as before.

Two guesses: odometry, corrected by what matching found wrong with it, and constant velocity. Matching tells how far
each can be believed, wherever the walls around leave no direction unseen.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.match.gauss_newton import BLIND, INLIERS
from mrslam.spatial.poses import compose
from mrslam.spatial.se2 import Transform

MAX_STEP_M, MAX_SPEED_M_S = 5.0, 3.0
"""Odometry that jumps farther between two scans, and faster where no scan came for long, is disbelieved."""
PAUSE_S, PAUSE_TIMES, INTERVAL_MEMORY = 2.0, 5.0, 0.1
"""No scan for so long, and for so many times the usual interval, is a pause: a robot that was dead, a laser unplugged.
What the motion was before says nothing then, and what the wheels tell is no jump."""
STEADY_S, MAX_TURN_RAD_S = 0.5, 6.0
"""Over no longer than this motion is thought to be steady, and no robot turns faster."""
STRETCH_M, STRETCH_RAD = 0.5, 0.5
"""Odometry is judged over stretches of this length, metres or radians: there, jitter from scan to scan averages out."""
LEARN = 0.05
"""Share of a new scan in what is known of the predictors' errors."""
LEARN_STRETCH = 0.1
"""Share of a new stretch in what is known of odometry."""
LEARN_VEER, VEER_MOST = 0.01, 0.5
"""The least share of a stretch in how odometry veers off, radians a metre; one that says more says nothing."""
GAIN_RANGE = 1.5
"""Odometry is thought to be off by at most this factor, either way."""
GOOD_INLIERS = 0.7
GO_ON = 0.8
"""Where a scan did not fit, the motion that it gave is not taken to go on, but the one before, and ever less of it."""
LEAST_ERROR = 0.03
DISBELIEVED = 0.6
"""Odometry that is wrong by more than this share of the way does not tell where the robot goes."""
LEAST_M, LEAST_RAD = 0.03, 0.03
"""Motions smaller than this tell nothing about errors that grow with motion."""

JUMP_M, JUMP_RAD = 0.3, 0.3
"""Odometry that changes its mind by more than this from one scan to the next may have jumped."""
APART_M, APART_RAD = 0.15, 0.15
"""Guesses farther apart than this lead to different matches."""

STILL = 1e-3
"""Wheels that turned less than this, metres and radians, say that the robot stands."""
DEAD = 5
"""So many scans that moved while the wheels stood make them dead, until they turn again."""

Guess = tuple[Transform, tuple[float, float, float], float]
"""A motion, its deviations (x, y, theta) from scan to scan, and its error per metre of way.

The last is what adds up over many scans; the deviations hold jitter, too, that does not.
"""

STOOD: Guess = np.zeros(3), (0.3, 0.3, 0.6), 1.0
"""After a pause: the robot is where it was, or turned there."""


class Predictor:
    """Guesses the motion from scan to scan, and how far off the guess may be."""

    def __init__(self, odometry_noise: float) -> None:
        """Start with odometry that errs by this share of the motion."""
        self.velocity: Transform = np.zeros(3)
        """The motion before, which may go on."""
        self.errors = np.array([[odometry_noise, odometry_noise], [0.5, 0.5]])
        """From scan to scan, of (odometry, constant velocity): share of the way, share of the turn."""
        self.gains = np.ones(2)
        """Truth as a multiple of what odometry says: way, turn."""
        self.veer = 0.0
        """What odometry misses of the turn with each metre of way, radians: wheels are not equally large."""
        self._veered = 0  # stretches that told so
        self.slip = odometry_noise
        """Error of corrected odometry over longer stretches, as a share of the way."""
        self.stuck = 0
        """Scans that moved while the wheels stood, since the wheels turned last."""
        self._told, self._found = np.zeros(3), np.zeros(3)
        self._seen = True
        self._step = np.zeros(3)
        self._interval_s, self._pause_s = 0.0, 0.0

    def wait(self, elapsed_s: float) -> None:
        """Take how long ago the scan before was taken; told before each scan but the first."""
        is_pause = elapsed_s > max(PAUSE_S, PAUSE_TIMES * self._interval_s) and self._interval_s > 0.0
        self._pause_s = elapsed_s if is_pause else 0.0
        if is_pause:  # nobody knows what it did meanwhile
            self.velocity, self._step = np.zeros(3), np.zeros(3)
        memory = INTERVAL_MEMORY if self._interval_s > 0.0 else 1.0
        self._interval_s += memory * (max(elapsed_s, 0.0) - self._interval_s)

    @property
    def is_after_pause(self) -> bool:
        """Whether nothing was seen for long before this scan."""
        return self._pause_s > 0.0

    def corrected(self, T_before_odom: Transform) -> Transform:
        """Return the motion that odometry means, judging by what matching found so far."""
        gain, turn = self.gains
        turned = turn * T_before_odom[2] + self.veer * _way(T_before_odom)
        return np.array([gain * T_before_odom[0], gain * T_before_odom[1], turned])

    def predict(self, T_before_odom: Transform | None) -> Guess:
        """Return the motion expected."""
        if T_before_odom is None or self._tells_nothing(T_before_odom):
            return self._steadily()
        if self.is_after_pause:
            return self._guess(self.corrected(T_before_odom), 0, 0)
        errors = self.errors
        along = 0 if self.slip < DISBELIEVED or errors[0, 0] <= errors[1, 0] else 1
        turning = 0 if errors[0, 1] <= errors[1, 1] else 1
        return self._guess(self.corrected(T_before_odom), along, turning)

    def carried(self, T_before_odom: Transform | None) -> Transform:
        """Return how far the robot went since the newest scan that was used, as far as wheels alone can tell."""
        if T_before_odom is None or self._tells_nothing(T_before_odom):
            return np.zeros(3)
        return self.corrected(T_before_odom)

    def speed(self, T_before_odom: Transform | None, elapsed_s: float) -> Transform:
        """Return how fast the robot moves, ``(3,)`` m/s and rad/s in its own frame; none where that is a guess."""
        if not 0.0 < elapsed_s <= STEADY_S:
            return np.zeros(3)
        velocity = self.predict(T_before_odom)[0] / elapsed_s
        is_possible = math.hypot(velocity[0], velocity[1]) <= MAX_SPEED_M_S and abs(velocity[2]) <= MAX_TURN_RAD_S
        return velocity if is_possible else np.zeros(3)

    def otherwise(self, T_before_odom: Transform | None, predicted: Transform) -> list[Guess]:
        """Return other motions, where the one predicted fits badly or cannot be seen.

        They are what odometry says if the motion before was preferred to it, and the motion before if odometry may have
        jumped or stopped to count. After a pause it is none at all: wheels that counted on while the robot was off may
        say anything.
        """
        if T_before_odom is None or self._tells_nothing(T_before_odom):
            return []
        told = self.corrected(T_before_odom)
        if self.is_after_pause:
            return [STOOD] if _apart(told, STOOD[0]) else []
        others = [self._guess(told, 0, 0)] if _apart(told, predicted) else []
        may_be_wrong = self._jumped(T_before_odom) or self.says_it_stands(T_before_odom)
        return [*others, self._steadily()] if may_be_wrong else others

    @property
    def was_moving(self) -> bool:
        """Whether the robot moved before this scan."""
        return math.hypot(self.velocity[0], self.velocity[1]) > LEAST_M or abs(self.velocity[2]) > LEAST_RAD

    def says_it_stands(self, T_before_odom: Transform | None) -> bool:
        """Return whether odometry says that the robot stands, and may be right."""
        return T_before_odom is not None and self.stuck < DEAD and _still(T_before_odom)

    def _tells_nothing(self, T_before_odom: Transform) -> bool:
        too_far = math.hypot(T_before_odom[0], T_before_odom[1]) > max(MAX_STEP_M, MAX_SPEED_M_S * self._pause_s)
        return too_far or (self.stuck >= DEAD and _still(T_before_odom))

    def _steadily(self) -> Guess:
        length, turn = math.hypot(self.velocity[0], self.velocity[1]), abs(self.velocity[2])
        return self.velocity, (0.05 + 0.5 * length, 0.05 + 0.5 * length, 0.05 + 0.5 * turn), 1.0

    def _guess(self, told: Transform, along: int, turning: int) -> Guess:
        choice = (told, self.velocity)
        motion = np.array([choice[along][0], choice[along][1], choice[turning][2]])
        length, turn = math.hypot(motion[0], motion[1]), abs(motion[2])
        sigma_xy = 0.008 + min(self.errors[along, 0], 1.0) * length + 0.02 * turn
        sigma_t = 0.005 + min(self.errors[turning, 1], 1.0) * turn + 0.05 * length
        return motion, (sigma_xy, sigma_xy, sigma_t), min(self.slip, 1.0) if along == 0 else 1.0

    def _jumped(self, T_before_odom: Transform) -> bool:
        before, way = self._step, math.hypot(self._step[0], self._step[1])
        gap = math.hypot(T_before_odom[0] - before[0], T_before_odom[1] - before[1])
        turn = abs(math.remainder(T_before_odom[2] - before[2], 2.0 * math.pi))
        return gap > max(JUMP_M, 2.0 * way) or turn > max(JUMP_RAD, 2.0 * abs(before[2]))

    def learn(
        self, motion: Transform, T_before_odom: Transform | None, match: NDArray[np.float64], *, refuted: bool = False
    ) -> None:
        """Follow how well each guess foretold the motion, where the match was good enough to tell.

        ``refuted`` : the scan fits a place that the prediction excluded.
        """
        if refuted and T_before_odom is not None and match[INLIERS] >= GOOD_INLIERS:
            self.slip += LEARN_STRETCH * (1.0 - self.slip)
        if T_before_odom is None or match[INLIERS] < GOOD_INLIERS:
            self._new_stretch()
        else:
            self._judge_stretch(motion, T_before_odom, match)
            self._judge_step(motion, T_before_odom, match)
        if self.is_after_pause:
            return
        if T_before_odom is not None:
            self._watch_standing(motion, T_before_odom, match)
        self.velocity = motion if match[INLIERS] >= GOOD_INLIERS else GO_ON * self.velocity
        self._step = np.zeros(3) if T_before_odom is None else T_before_odom

    def _watch_standing(self, motion: Transform, T_before_odom: Transform, match: NDArray[np.float64]) -> None:
        """Count scans that moved while the wheels said that the robot stands."""
        if not _still(T_before_odom):
            self.stuck = 0
        elif math.hypot(motion[0], motion[1]) > LEAST_M or abs(motion[2]) > LEAST_RAD:
            self.stuck += match[INLIERS] >= GOOD_INLIERS
        elif self.stuck < DEAD:
            self.stuck = max(self.stuck - 1, 0)

    def _judge_step(self, motion: Transform, T_before_odom: Transform, match: NDArray[np.float64]) -> None:
        length, turn = math.hypot(motion[0], motion[1]), abs(motion[2])
        for k, guess in enumerate((self.corrected(T_before_odom), self.velocity)):
            if length > LEAST_M and match[BLIND] == 0.0:
                share = min(math.hypot(guess[0] - motion[0], guess[1] - motion[1]) / length, 3.0)
                self.errors[k, 0] = max(self.errors[k, 0] + LEARN * (share - self.errors[k, 0]), LEAST_ERROR)
            if turn > LEAST_RAD:
                share = min(abs(math.remainder(guess[2] - motion[2], 2.0 * math.pi)) / turn, 3.0)
                self.errors[k, 1] = max(self.errors[k, 1] + LEARN * (share - self.errors[k, 1]), LEAST_ERROR)

    def _judge_stretch(self, motion: Transform, T_before_odom: Transform, match: NDArray[np.float64]) -> None:
        self._told, self._found = compose(self._told, T_before_odom), compose(self._found, motion)
        self._seen &= match[BLIND] == 0.0
        way, turn = math.hypot(self._found[0], self._found[1]), abs(self._found[2])
        if way > STRETCH_M and self._seen:
            gain = self.gains[0]
            missed = math.hypot(gain * self._told[0] - self._found[0], gain * self._told[1] - self._found[1]) / way
            self.slip += LEARN_STRETCH * (min(max(missed, LEAST_ERROR), 3.0) - self.slip)
            told = math.hypot(self._told[0], self._told[1])
            dot = self._told[0] * self._found[0] + self._told[1] * self._found[1]
            if dot > 0.8 * way * told:
                self.gains[0] += LEARN_STRETCH * (_bounded(way / told) - gain)
                if turn < STRETCH_RAD:
                    self._learn_veer((self._found[2] - self.gains[1] * self._told[2]) / _way(self._told))
        if turn > STRETCH_RAD and self._told[2] * self._found[2] > 0.0:
            self.gains[1] += LEARN_STRETCH * (_bounded(self._found[2] / self._told[2]) - self.gains[1])
        if way > STRETCH_M or turn > STRETCH_RAD:
            self._new_stretch()

    def _learn_veer(self, veer: float) -> None:
        """Average what the stretches say, in the end over the last hundred of them: one alone says little."""
        if abs(veer) < VEER_MOST:
            self._veered += 1
            self.veer += max(1.0 / (self._veered + 1), LEARN_VEER) * (veer - self.veer)

    def _new_stretch(self) -> None:
        self._told, self._found, self._seen = np.zeros(3), np.zeros(3), True

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed predictor needs."""
        return {
            "velocity": self.velocity, "errors": self.errors, "gains": self.gains, "slip": self.slip,
            "stretch": [self._told, self._found, bool(self._seen)], "step": self._step,
            "interval_s": self._interval_s, "veer": [self.veer, self._veered], "stuck": int(self.stuck),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the predictor that was saved."""
        self.velocity, self.errors, self.gains = (state[k] for k in ("velocity", "errors", "gains"))
        self.slip = state["slip"]
        self._told, self._found, self._seen = state["stretch"]
        self._step, self._interval_s = state["step"], state["interval_s"]
        self.veer, self._veered = state["veer"]
        self.stuck = state["stuck"]


def _apart(one: Transform, two: Transform) -> bool:
    turn = abs(math.remainder(one[2] - two[2], 2.0 * math.pi))
    return math.hypot(one[0] - two[0], one[1] - two[1]) > APART_M or turn > APART_RAD


def _still(motion: Transform) -> bool:
    return math.hypot(motion[0], motion[1]) < STILL and abs(motion[2]) < STILL


def _way(motion: Transform) -> float:
    """Return how far it led, backward as less than nothing."""
    return math.copysign(math.hypot(motion[0], motion[1]), motion[0])


def _bounded(gain: float) -> float:
    return min(max(gain, 1.0 / GAIN_RANGE), GAIN_RANGE)
