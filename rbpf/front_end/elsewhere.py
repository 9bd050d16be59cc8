"""Whether a robot that sees suddenly something else was carried off with its laser on.

Between two scans nothing moves far, so both see the same surfaces, and later ones fit what was seen before. Where one
fits badly and contradicts the one before it, each showing what the other should have seen, too, two accounts are
followed: the robot drives on in what it saw before, or it begins elsewhere with this scan. Somebody who steps before
the laser, or a scan of rubbish, leaves the first right; a robot that was carried sees only the second confirmed.
"""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.local_matcher import BAD_INLIERS, LocalMatcher
from mrslam.rbpf.front_end.prediction import Guess
from mrslam.rbpf.front_end.rolling_map import RollingMap
from mrslam.rbpf.front_end.visibility import contradicted
from mrslam.spatial import se2
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.poses import compose
from mrslam.spatial.se2 import Transform

TORN, TORN_LEAPT = 0.3, 0.15
"""Two scans did not see one place where each contradicts more of the other than the first, as a share, or than the
second where they match only by a leap that odometry knows nothing of. People passing make up to 0.28."""
AGREED_LEAST, AGREED_S = 5, 0.4
"""Scans that fit what is seen elsewhere, and seconds, at least: what passes the laser is gone by then. On rough ground
before trees nothing fits, and nothing is known."""
FOLLOWED_MOST, FOLLOWED_MOST_S = 50, 3.0
"""Scans and seconds after which the robot was not carried, if neither account has won."""
SURE = math.log(1e3)
"""Log of the odds at which it was: torn scans are rare, and about as often of robots that were carried as not."""
FITTED_LEAST = 5
"""Scans in a row that fit what was seen before: one may do so by chance."""


class View(NamedTuple):
    """What one scan saw."""

    points: NDArray[np.float64]
    """``(N, 5)``, base frame."""
    origin: NDArray[np.float64]
    """``(2,)``, of the laser, base frame, metres."""

    def contradiction(self, other: View, T_other_self: Transform) -> float:
        """Return the share, 0..1, of either scan at least that another one should have seen, too, and did not."""
        back = se2.inverse(T_other_self)
        return min(
            contradicted(self.points, other.points, T_other_self, self.origin),
            contradicted(other.points, self.points, back, self.origin),
        )


class Account:
    """A map, and where the robot is in it."""

    def __init__(self, rolling: RollingMap, matcher: LocalMatcher, T_local_base: Transform) -> None:
        self.map, self.matcher, self.T_local_base = rolling, matcher, T_local_base

    def follow(self, points: NDArray[np.float64], guess: Guess) -> Match:
        """Match a scan's ``points (n, 5)`` after the motion guessed, and move there."""
        start = compose(self.T_local_base, guess.motion)
        found = self.matcher.match(self.map.tiles_around(start), points, start, guess)
        self.T_local_base = found.pose
        return found

    def state(self) -> list[Any]:
        """Return all of it."""
        return [self.map.state(), self.matcher.usual_score, self.T_local_base]

    def restore(self, state: list[Any]) -> None:
        """Become what was saved."""
        self.map.restore(state[0])
        self.matcher.usual_score, self.T_local_base = state[1:]


class Elsewhere:
    """Both accounts, from a scan on that is torn from the one before it."""

    def __init__(self, config: MapperConfig, usual_score: float) -> None:
        """Know how well scans fit where the robot came from."""
        self._here = Account(RollingMap(config), _matcher(config, usual_score), np.zeros(3))
        self.there = Account(RollingMap(config), _matcher(config, usual_score), np.zeros(3))
        """The account of a robot that was carried."""
        self._evidence_beams = config.evidence_beams
        self._log_odds = 0.0
        self._agreed, self._fitted, self._followed, self._waited_s = 0, 0, 0, 0.0

    def begin(self, before: RollingMap, T_local_base: Transform, all_points: NDArray[np.float64]) -> None:
        """Begin with a scan ``(N, 5)`` that may be at a pose ``(3,)`` in the rolling map of what was ``before``."""
        self._here.map.draw_again(before)
        self._here.T_local_base = self.there.T_local_base = T_local_base
        self.there.map.tiles_around(T_local_base)
        self.there.map.add(T_local_base, all_points)

    def follow(
        self, points: NDArray[np.float64], all_points: NDArray[np.float64], guess: Guess, elapsed_s: float
    ) -> bool | None:
        """Take the next scan; return whether the robot was carried, None while that is not known."""
        self._followed += 1
        self._waited_s += elapsed_s
        here, there = self._here.follow(points, guess._replace(slip=0.0)), self.there.follow(points, guess)
        self._log_odds += self._evidence_beams * (there.score - here.score)
        self._fitted = 0 if self._here.matcher.is_doubtful(here) else self._fitted + 1
        if self.there.map.is_due(there.pose):
            self.there.map.add(there.pose, all_points)
        self._agreed += there.inliers >= BAD_INLIERS
        is_long = self._agreed >= AGREED_LEAST and self._waited_s >= AGREED_S
        if is_long and self._log_odds >= SURE and self._fitted == 0:
            return True
        is_over = self._followed >= FOLLOWED_MOST or self._waited_s >= FOLLOWED_MOST_S
        return False if is_over or self._fitted >= FITTED_LEAST else None

    def state(self) -> list[Any]:
        """Return everything that a resumed front end needs."""
        return [
            self._here.state(),
            self.there.state(),
            self._log_odds,
            self._agreed,
            self._fitted,
            self._followed,
            self._waited_s,
        ]

    def restore(self, state: list[Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self._here.restore(state[0])
        self.there.restore(state[1])
        self._log_odds, self._agreed, self._fitted, self._followed, self._waited_s = state[2:]


def _matcher(config: MapperConfig, usual_score: float) -> LocalMatcher:
    matcher = LocalMatcher(config.sigma_m)
    matcher.usual_score = usual_score
    return matcher
