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

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.crew import Crew
from mrslam.rbpf.front_end.prediction import DISBELIEVED, Predictor
from mrslam.rbpf.match.correlative import search
from mrslam.rbpf.match.gauss_newton import BLIND, CONFLICTS, INFO, INLIERS, RESULT_SIZE, SCORE, match
from mrslam.rbpf.match.nearest import COS, SIN
from mrslam.rbpf.tiles.store import TileStore
from mrslam.spatial.poses import between, compose
from mrslam.spatial.se2 import Transform

KEY_DISTANCE_M, KEY_TURN_RAD = 0.2, 0.15
"""A scan enters the local map after this much motion: a robot at rest adds nothing."""
KEYS_MOST, KEYS_KEPT = 60, 30
"""The local map is made anew of the last so many scans whenever it holds so many."""
GOOD_INLIERS = 0.85
TURN_SEARCHED_RAD = 0.1
"""Turns larger than this between two scans are searched, not only descended."""
BAD_INLIERS = 0.6
LOST_INLIERS = 0.4
"""Where no more fits after a search, and no wheels tell, the robot may look anywhere: it turned while no scans came."""
WORSE, BETTER, USUAL_MEMORY = 0.15, 0.08, 0.05
"""A match whose score is so much worse than usual is doubted. Another, far from the prediction, replaces it only if it
is as good as usual again, or much better: where everything fits badly, self-similar places are everywhere."""
STANDING = 0.02
"""A robot whose wheels stand moved if another place fits by so much better."""
NEAR_M, FAR_M = 0.1, 0.4
"""How far to either side a better match is looked for: when in slight doubt, and in serious doubt, metres."""
FAR_TURN_RAD = 0.45
FAR_PRIOR = np.diag([1.0 / 0.3**2, 1.0 / 0.3**2, 1.0 / 0.1**2])
ADRIFT_MEMORY = 0.1
"""Share of a new scan in how far the robot drives without anything that tells where to."""
CORRELATED = 1.0
"""Beams are not independent of each other: their information counts by this share beside the prediction's."""


@dataclass(frozen=True, eq=False)
class Step:
    """Motion of the base from the scan before to this one."""

    T_before_base: Transform
    """``(3,)``."""
    score: float
    """Mean log-likelihood of a beam relative to a perfect fit."""
    inliers: float
    """Share of beams that lie on the local map."""
    blind_m: NDArray[np.float64]
    """``(2,)``, base frame: direction in which nothing was seen of the motion, as long as the error to expect there."""


class FrontEnd:
    """The rolling local map and the robot's pose in it."""

    def __init__(self, config: MapperConfig, crew: Crew | None = None) -> None:
        self._crew = crew
        self.sigma_m = config.sigma_m
        self.reach_m = config.usable_range_m + 2.0
        self.store = TileStore(1, config.resolution_m)
        self.T_local_base: Transform = np.zeros(3)
        self.predictor = Predictor(config.odometry_noise)
        self.keys: list[tuple[Transform, NDArray[np.float64]]] = []
        self.usual = -0.5
        """Score of a good match here."""
        self.adrift = 0.0
        """0..1: how far motion of late was only guessed, neither seen nor told by odometry that proved right."""
        self._out = np.zeros(RESULT_SIZE)
        self._start = np.zeros(3)
        self._prior = np.zeros((3, 3))

    def step(
        self,
        points: NDArray[np.float64],
        all_points: NDArray[np.float64],
        T_before_odom: Transform | None,
        elapsed_s: float,
    ) -> Step:
        """Match a scan, given the motion by odometry if there is some, and extend the local map.

        ``elapsed_s`` : since the scan before.
        """
        before = self.T_local_base
        if not self.keys:
            self._add_key(before, all_points)
            return Step(np.zeros(3), 0.0, 1.0, np.zeros(2))
        self.predictor.wait(elapsed_s)
        predicted, spread, slip = self.predictor.predict(T_before_odom)
        out = self._match(points, compose(before, predicted), predicted, spread, slip)
        doubtful = self._doubtful(out)
        unseen = out[BLIND] > 0.0 and not doubtful
        stands = self.predictor.says_it_stands(T_before_odom)
        if doubtful or unseen or (stands and (out[INLIERS] < GOOD_INLIERS or self.predictor.was_moving)):
            best, least = out.copy(), self._least(out)
            if stands and not doubtful:  # then it sees what it saw
                least = out[SCORE] + STANDING
            elif unseen:  # odometry may have jumped: where walls do not tell, the motion before is the better guess
                least = out[SCORE] - BETTER
            for other in self.predictor.otherwise(T_before_odom, predicted):
                self._match(points, compose(before, other[0]), *other)
                # Where it stood before a pause it sees what it saw; less would fit in any similar room.
                is_there = out[INLIERS] >= GOOD_INLIERS or not self.predictor.is_after_pause
                if out[SCORE] > least and is_there and not (stands and out[BLIND] > 0.0):
                    best, least = out.copy(), out[SCORE]
                    predicted, spread, slip = other
            out[:] = best
        self.T_local_base = out[:3].copy()
        motion = between(before, self.T_local_base)
        missed = between(predicted, motion)
        self.predictor.learn(motion, T_before_odom, out, refuted=math.hypot(missed[0], missed[1]) > NEAR_M)
        guessed = float(out[BLIND]) if slip > DISBELIEVED else 0.0
        self.adrift += ADRIFT_MEMORY * (guessed - self.adrift)
        if out[INLIERS] < LOST_INLIERS:
            self.adrift = 1.0
        since = between(self.keys[-1][0], self.T_local_base)
        if math.hypot(since[0], since[1]) > KEY_DISTANCE_M or abs(since[2]) > KEY_TURN_RAD:
            self._add_key(self.T_local_base, all_points)
        return Step(motion, float(out[SCORE]), float(out[INLIERS]), self._blind(motion, slip, out))

    def knows(self, points: NDArray[np.float64], T_before_odom: Transform | None) -> bool:
        """Return whether a scan fits what was seen before, where the robot is expected; nothing is learnt of it."""
        motion, spread, _ = self.predictor.predict(T_before_odom)
        self._descend(points, compose(self.T_local_base, motion), spread)
        return bool(self._out[INLIERS] >= BAD_INLIERS)

    def _match(
        self,
        points: NDArray[np.float64],
        start: Transform,
        motion: Transform,
        spread: tuple[float, float, float],
        slip: float,
    ) -> NDArray[np.float64]:
        out, place = self._out, self._descend(points, start, spread)
        half_turn = min(0.05 + 3.0 * spread[2], 0.6)
        # Without odometry that proved right there is nothing better than to look.
        half_shift_m = min(max(NEAR_M, 2.0 * spread[0]), FAR_M) if slip > DISBELIEVED else NEAR_M
        if out[INLIERS] < GOOD_INLIERS or abs(motion[2]) > TURN_SEARCHED_RAD or slip > DISBELIEVED:
            self._search(place, start, half_turn, half_shift_m, out[SCORE])
        if self._doubtful(out):
            # The prediction may be far off, and wrong about how far: look around, and let the scan alone decide.
            self._search(place, start, max(half_turn, FAR_TURN_RAD), FAR_M, self._least(out), far=True)
            if out[INLIERS] < LOST_INLIERS and slip > DISBELIEVED:
                self._search(place, start, math.pi, FAR_M, self._least(out), far=True)
        if out[INLIERS] > GOOD_INLIERS:
            self.usual += USUAL_MEMORY * (float(out[SCORE]) - self.usual)
        return out

    def _descend(self, points: NDArray[np.float64], start: Transform, spread: tuple[float, float, float]) -> Any:
        """Match a scan from where it is expected, and return what to match it to from elsewhere."""
        store = self.store
        store.cover(start[:2] - self.reach_m, start[:2] + self.reach_m)
        place = (store.pool, store.tables[0], store.row0, store.col0, store.resolution_m, points)
        for k in range(3):
            self._prior[k, k] = 1.0 / (CORRELATED * spread[k] ** 2)
        match(*place, start, start, self._prior, self.sigma_m, 12, COS, SIN, self._out)
        return place

    def _doubtful(self, out: NDArray[np.float64]) -> bool:
        return bool(out[INLIERS] < BAD_INLIERS or out[SCORE] < self.usual - WORSE)

    def _least(self, out: NDArray[np.float64]) -> float:
        """Return the score that a match must have to be believed against the prediction."""
        better = float(out[SCORE]) + BETTER
        return better + min(max(self.usual - WORSE / 2.0 - better, 0.0), 2.0 * BETTER)

    def _search(
        self, place: Any, start: Transform, half_turn: float, half_shift_m: float, least: float, far: bool = False
    ) -> None:
        """Match from the best place around ``start``, and keep what comes out if its score is above ``least``.

        Near by, the prediction still counts; far off, what the search found takes its place.
        """
        first, found = self._out.copy(), self._start
        step_rad = 0.03 if far else 0.015
        search(*place, 60, start, half_turn, step_rad, half_shift_m, 0.1, COS, SIN, out=found, crew=self._crew)
        prior, centre = (FAR_PRIOR, found) if far else (self._prior, start)
        match(*place, found, centre, prior, self.sigma_m, 12, COS, SIN, self._out)  # type: ignore[call-arg]
        if self._out[SCORE] <= least:
            self._out[:] = first

    def _blind(self, motion: Transform, slip: float, out: NDArray[np.float64]) -> NDArray[np.float64]:
        c, s = math.cos(self.T_local_base[2]), math.sin(self.T_local_base[2])
        along = c * out[BLIND + 1] + s * out[BLIND + 2]
        across = -s * out[BLIND + 1] + c * out[BLIND + 2]
        error = out[BLIND] * slip * (motion[0] * along + motion[1] * across)
        return np.array([error * along, error * across])

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
            "store": self.store.state(), "T_local_base": self.T_local_base,
            "predictor": self.predictor.state(), "usual": self.usual, "adrift": self.adrift,
            "keys": [[pose, points] for pose, points in self.keys],
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the front end that was saved."""
        self.store.restore(state["store"])
        self.T_local_base = state["T_local_base"]
        self.predictor.restore(state["predictor"])
        self.usual, self.adrift = state["usual"], state["adrift"]
        self.keys = [(pose, points) for pose, points in state["keys"]]


def information(out: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the ``(3, 3)`` information matrix of a match's result row."""
    xx, xy, xt, yy, yt, tt = out[INFO : INFO + 6]
    return np.array([[xx, xy, xt], [xy, yy, yt], [xt, yt, tt]])


__all__ = ["CONFLICTS", "FrontEnd", "Step", "information"]
