"""Every scan against the last few metres: dense, precise motion at the price of one match a scan.

All particles share it. It works in a frame of its own (``local``) that drifts slowly; what the filter takes from it is
the motion between scans.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rbpf.config import MapperConfig
from rbpf.matching import CONFLICTS, INFO, INLIERS, RESULT_SIZE, SCORE, direction_tables, match, search
from rbpf.poses import between, compose
from rbpf.tile_store import TileStore
from spatial.se2 import Transform

KEY_DISTANCE_M, KEY_TURN_RAD = 0.2, 0.15
"""A scan enters the local map after this much motion: a robot at rest adds nothing."""
KEYS_MOST, KEYS_KEPT = 60, 30
"""The local map is made anew of the last so many scans whenever it holds so many."""
GOOD_INLIERS = 0.85
TURN_SEARCHED_RAD = 0.1
"""Turns larger than this between two scans are searched, not only descended."""
MAX_STEP_M = 5.0
"""Odometry that jumps farther between two scans is disbelieved, metres."""
STRETCH_M = 0.5
"""Odometry's slip is judged over stretches of this length."""
BAD_INLIERS = 0.6
CORRELATED = 1.0
"""Beams are not independent of each other: their information counts by this share beside the prediction's."""
SEEN_WELL = 2e3
"""Information (1/m^2) along the direction seen least from which on a match can judge odometry: no bare corridors."""
LEARN = 0.05
"""Share of a new scan in what is known of the predictors' errors."""

COS, SIN = direction_tables()


@dataclass(frozen=True, eq=False)
class Step:
    """Motion of the base from the scan before to this one."""

    T_before_base: Transform
    """``(3,)``."""
    score: float
    """Mean log-likelihood of a beam relative to a perfect fit."""
    inliers: float
    """Share of beams that lie on the local map."""


class FrontEnd:
    """The rolling local map and the robot's pose in it."""

    def __init__(self, config: MapperConfig) -> None:
        self.sigma_m = config.sigma_m
        self.reach_m = config.usable_range_m + 2.0
        self.store = TileStore(1, config.resolution_m)
        self.T_local_base: Transform = np.zeros(3)
        self.velocity: Transform = np.zeros(3)
        self.keys: list[tuple[Transform, NDArray[np.float64]]] = []
        # Errors of the two predictors (odometry, constant velocity) as shares of the motion: along, turning.
        self.errors = np.array([[config.odometry_noise, config.odometry_noise], [0.5, 0.5]])
        # Odometry's error as a share of the way, over stretches long enough that jitter does not count.
        self.slip = config.odometry_noise
        self._by_odom, self._by_match, self._seen_well = np.zeros(3), np.zeros(3), True
        self._out = np.zeros(RESULT_SIZE)
        self._start = np.zeros(3)
        self._prior = np.zeros((3, 3))

    def step(
        self, points: NDArray[np.float64], all_points: NDArray[np.float64], T_before_odom: Transform | None
    ) -> Step:
        """Match a scan, given the motion by odometry if there is some, and extend the local map."""
        before = self.T_local_base
        if not self.keys:
            self._add_key(before, all_points)
            return Step(np.zeros(3), 0.0, 1.0)
        predicted, spread = self._predict(T_before_odom)
        out = self._match(points, compose(before, predicted), predicted, spread)
        if out[INLIERS] < BAD_INLIERS and T_before_odom is not None and _apart(T_before_odom, self.velocity):
            # Odometry may have jumped: without it the motion before is the best guess.
            doubted = out.copy()
            predicted, spread = self._predict(None)
            out = self._match(points, compose(before, predicted), predicted, spread)
            if doubted[SCORE] >= out[SCORE]:
                out[:] = doubted
        self.T_local_base = out[:3].copy()
        motion = between(before, self.T_local_base)
        self._learn(motion, T_before_odom, out)
        self.velocity = motion
        since = between(self.keys[-1][0], self.T_local_base)
        if math.hypot(since[0], since[1]) > KEY_DISTANCE_M or abs(since[2]) > KEY_TURN_RAD:
            self._add_key(self.T_local_base, all_points)
        return Step(motion, float(out[SCORE]), float(out[INLIERS]))

    def _predict(self, T_before_odom: Transform | None) -> tuple[Transform, tuple[float, float, float]]:
        """Return the predicted motion and the standard deviations (x, y, theta) of it."""
        steady = self.velocity
        if T_before_odom is None or math.hypot(T_before_odom[0], T_before_odom[1]) > MAX_STEP_M:
            length, turn = math.hypot(steady[0], steady[1]), abs(steady[2])
            return steady, (0.05 + 0.5 * length, 0.05 + 0.5 * length, 0.05 + 0.5 * turn)
        errors = self.errors
        along, turning = (0 if errors[0, k] <= errors[1, k] else 1 for k in (0, 1))
        choice = (T_before_odom, steady)
        motion = np.array([*choice[along][:2], choice[turning][2]])
        length, turn = math.hypot(motion[0], motion[1]), abs(motion[2])
        share = errors[along, 0]
        sigma_xy = 0.008 + min(share, 1.0) * length + 0.02 * turn
        sigma_t = 0.005 + min(self.errors[turning, 1], 1.0) * turn + 0.05 * length
        return motion, (sigma_xy, sigma_xy, sigma_t)

    def _match(
        self, points: NDArray[np.float64], start: Transform, motion: Transform, spread: tuple[float, float, float]
    ) -> NDArray[np.float64]:
        store = self.store
        store.cover(start[:2] - self.reach_m, start[:2] + self.reach_m)
        place = (store.pool, store.tables[0], store.row0, store.col0, store.resolution_m, points)
        prior = self._prior
        for k in range(3):
            prior[k, k] = 1.0 / (CORRELATED * spread[k] ** 2)
        out = self._out
        match(*place, start, start, prior, self.sigma_m, 12, COS, SIN, out)
        if out[INLIERS] < GOOD_INLIERS or abs(motion[2]) > TURN_SEARCHED_RAD:
            first = out.copy()
            half_turn, half_shift = 0.05 + 3.0 * spread[2], 0.1
            search(*place, 60, start, min(half_turn, 0.6), 0.015, half_shift, 0.1, COS, SIN, self._start)
            match(*place, self._start, start, prior, self.sigma_m, 12, COS, SIN, out)
            if first[SCORE] >= out[SCORE]:
                out[:] = first
        return out

    def _learn(self, motion: Transform, T_before_odom: Transform | None, out: NDArray[np.float64]) -> None:
        """Follow how well each predictor foretold the motion, where the match was good enough to tell."""
        if T_before_odom is None or out[INLIERS] < 0.7:
            self._by_odom, self._by_match, self._seen_well = np.zeros(3), np.zeros(3), True
            return
        self._by_odom, self._by_match = compose(self._by_odom, T_before_odom), compose(self._by_match, motion)
        self._seen_well &= weakest(out) > SEEN_WELL
        way = math.hypot(self._by_match[0], self._by_match[1])
        if way > STRETCH_M or abs(self._by_match[2]) > 0.5:
            if self._seen_well and way > STRETCH_M:
                missed = math.hypot(self._by_odom[0] - self._by_match[0], self._by_odom[1] - self._by_match[1]) / way
                self.slip += 2.0 * LEARN * (min(max(missed, 0.03), 3.0) - self.slip)
            self._by_odom, self._by_match, self._seen_well = np.zeros(3), np.zeros(3), True
        length, turn = math.hypot(motion[0], motion[1]), abs(motion[2])
        if (length <= 0.03 or weakest(out) <= SEEN_WELL) and turn <= 0.03:
            return
        for k, guess in enumerate((T_before_odom, self.velocity)):
            if length > 0.03 and weakest(out) > SEEN_WELL:
                share = min(math.hypot(guess[0] - motion[0], guess[1] - motion[1]) / length, 3.0)
                self.errors[k, 0] += LEARN * (share - self.errors[k, 0])
            if turn > 0.03:
                share = min(abs(math.remainder(guess[2] - motion[2], 2.0 * math.pi)) / turn, 3.0)
                self.errors[k, 1] += LEARN * (share - self.errors[k, 1])
        np.maximum(self.errors, 0.03, out=self.errors)

    def _add_key(self, pose: Transform, points: NDArray[np.float64]) -> None:
        self.keys.append((pose.copy(), points.copy()))
        if len(self.keys) >= KEYS_MOST:
            self.keys = self.keys[-KEYS_KEPT:]
            self.store.clear(0)
            for old, old_points in self.keys:
                self.store.add_points(0, old, old_points)
        else:
            self.store.add_points(0, pose, points)

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed front end needs."""
        return {
            "store": self.store.state(), "T_local_base": self.T_local_base, "velocity": self.velocity,
            "errors": self.errors, "slip": self.slip, "stretch": [self._by_odom, self._by_match, self._seen_well],
            "keys": [[pose, points] for pose, points in self.keys],
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the front end that was saved."""
        self.store.restore(state["store"])
        self.T_local_base, self.velocity, self.errors = (state[k] for k in ("T_local_base", "velocity", "errors"))
        self.slip = state["slip"]
        self._by_odom, self._by_match, self._seen_well = state["stretch"]
        self.keys = [(pose, points) for pose, points in state["keys"]]


def _apart(one: Transform, two: Transform) -> bool:
    return (
        math.hypot(one[0] - two[0], one[1] - two[1]) > 0.15
        or abs(math.remainder(one[2] - two[2], 2.0 * math.pi)) > 0.15
    )


def information(out: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ``(3, 3)`` information matrix of a match's result row."""
    xx, xy, xt, yy, yt, tt = out[INFO : INFO + 6]
    return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])


def weakest(out: NDArray[np.float64]) -> float:
    """Return the information (1/m^2) on position along the direction that the match saw least."""
    xx, xy, yy = out[INFO], out[INFO + 1], out[INFO + 3]
    return float(0.5 * (xx + yy) - math.hypot(0.5 * (xx - yy), xy))


__all__ = ["CONFLICTS", "FrontEnd", "Step", "information", "weakest"]
