"""A scan's pose in the rolling map: Gauss-Newton from the prediction, correlative searches where that fits badly."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.front_end.prediction import DISBELIEVED, Guess
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.correlative import Lattice, search
from mrslam.spatial.matching.gauss_newton import Match, match
from mrslam.spatial.runtime.crew import Crew
from mrslam.spatial.se2 import Transform

GOOD_INLIERS, BAD_INLIERS, LOST_INLIERS = 0.85, 0.6, 0.4
"""Shares of inliers: where fewer than the first fit a search is tried, where fewer than the second the match is
doubted, and where fewer than the third the robot may look anywhere: it turned while no scans came."""
WORSE, BETTER = 0.15, 0.08
"""A match whose score is worse than usual by the first is doubted. Another, far from the prediction, replaces it only
if it is as good as usual again, or better by the second: where everything fits badly, self-similar places are
everywhere."""
LEAP_SIGMAS, LEAP_BETTER = 3.0, 0.2
"""Where odometry proved right, a match farther from where it leads than the first, standard deviations of its position,
must be better by the second. Measured: leaps of recorded logs that odometry had missed were better by 0.26 and more; a
scan half of which was another robot's body fitted its trace of before, 0.3 m off, better by 0.13."""
USUAL_AT_FIRST, USUAL_MEMORY = -0.5, 0.05
"""Score of a good match before there was one, and share of a new one in what is usual."""
ITERATIONS = 12
"""Most steps of a descent: it bounds the time of a scan that fits nowhere."""
POINTS_SEARCHED = 60
"""Points that a search uses: it has to find the valley, not its bottom."""
TURN_SEARCHED_RAD = 0.1
"""Turns larger than this between two scans are searched, not only descended."""
NEAR_M, FAR_M = 0.1, 0.4
"""Half width of the search near the prediction, at least, and of the one farther off, metres."""
NEAR_TURN_RAD, NEAR_TURN_SIGMAS, NEAR_TURN_MOST_RAD = 0.05, 3.0, 0.6
"""Half width in heading of the search near the prediction: the first, plus the second times the guess's deviation,
but at most the third."""
FAR_TURN_RAD = 0.45
"""Half width in heading of the search farther off, at least."""
NEAR_STEP_RAD, FAR_STEP_RAD, STEP_M = 0.015, 0.03, 0.1
"""Steps of the searches: Gauss-Newton converges from half a step off."""
FAR_PRIOR = np.diag([1.0 / 0.3**2, 1.0 / 0.3**2, 1.0 / 0.1**2])
"""Information ``(3, 3)`` of a pose that the search farther off found: deviations of three steps, 0.3 m and 0.1 rad."""


FARTHEST_M = 1.5
"""No match is believed farther from the prediction than this, metres: the searches reach 0.6 m, and a descent from
there may slide along a wall. On recorded logs the farthest was at 0.8 m."""


class _Aim(NamedTuple):
    """What to match, to what, and where."""

    tiles: Tiles
    points: NDArray[np.float64]
    """``(N, 5)``, base frame."""
    start: Transform
    """``(3,)``, predicted pose in the rolling map."""
    prior: NDArray[np.float64]
    """``(3, 3)``, information of ``start``."""


class LocalMatcher:
    """Matches scans, and knows how well they usually fit here."""

    def __init__(self, sigma_m: float, crew: Crew | None = None) -> None:
        """Match with this scale of distances, metres; searches are shared with an idle ``crew``."""
        self._sigma_m = sigma_m
        self._crew = crew
        self.usual_score = USUAL_AT_FIRST
        """Moving average of the score of matches with more than ``GOOD_INLIERS``."""

    def descend(self, tiles: Tiles, points: NDArray[np.float64], start: Transform, guess: Guess) -> Match:
        """Match ``points (N, 5)`` from where they are expected, without any search; nothing is learnt from it."""
        return self._descend(_aim(tiles, points, start, guess))

    def match(self, tiles: Tiles, points: NDArray[np.float64], start: Transform, guess: Guess) -> Match:
        """Return where ``points (N, 5)`` fit best: near ``start (3,)``, and farther off where they do not fit there."""
        aim = _aim(tiles, points, start, guess)
        found = self._descend(aim)
        is_lost = guess.slip > DISBELIEVED  # without odometry that proved right there is nothing better than to look
        half_turn = min(NEAR_TURN_RAD + NEAR_TURN_SIGMAS * guess.sigma_rad, NEAR_TURN_MOST_RAD)
        if found.inliers < GOOD_INLIERS or abs(guess.motion[2]) > TURN_SEARCHED_RAD or is_lost:
            half_shift_m = min(max(NEAR_M, 2.0 * guess.sigma_m), FAR_M) if is_lost else NEAR_M
            found = self._search_near(aim, found, half_turn, half_shift_m)
        if self.is_doubtful(found):
            found = self._search_far(aim, found, max(half_turn, FAR_TURN_RAD), is_lost=is_lost)
            if found.inliers < LOST_INLIERS and is_lost:
                found = self._search_far(aim, found, math.pi, is_lost=is_lost)
        if not math.hypot(found.pose[0] - start[0], found.pose[1] - start[1]) <= FARTHEST_M:
            found = match(tiles, points, start, start, aim.prior, self._sigma_m, 0)
        if found.inliers > GOOD_INLIERS:
            self.usual_score += USUAL_MEMORY * (found.score - self.usual_score)
        return found

    def is_doubtful(self, found: Match) -> bool:
        """Return whether a scan fits much worse than usual."""
        return found.inliers < BAD_INLIERS or found.score < self.usual_score - WORSE

    def score_to_beat(self, found: Match) -> float:
        """Return the score that a match far from the prediction must exceed to replace this one."""
        better = found.score + BETTER
        return better + min(max(self.usual_score - WORSE / 2.0 - better, 0.0), 2.0 * BETTER)

    def _descend(self, aim: _Aim) -> Match:
        return match(aim.tiles, aim.points, aim.start, aim.start, aim.prior, self._sigma_m, ITERATIONS)

    def _search_near(self, aim: _Aim, found: Match, half_turn: float, half_shift_m: float) -> Match:
        """Return the match around the best place near by, the prediction still counting, if it is better."""
        lattice = Lattice(half_turn, NEAR_STEP_RAD, half_shift_m, STEP_M, POINTS_SEARCHED)
        place = search(aim.tiles, aim.points, aim.start, lattice, self._crew).pose
        other = match(aim.tiles, aim.points, place, aim.start, aim.prior, self._sigma_m, ITERATIONS)
        return other if other.score > found.score else found

    def _search_far(self, aim: _Aim, found: Match, half_turn: float, *, is_lost: bool) -> Match:
        """Return the match around the best place farther off, without the prediction, if it beats the score to beat.

        ``is_lost`` : whether there is no odometry that proved right.
        """
        lattice = Lattice(half_turn, FAR_STEP_RAD, FAR_M, STEP_M, POINTS_SEARCHED)
        place = search(aim.tiles, aim.points, aim.start, lattice, self._crew).pose
        other = match(aim.tiles, aim.points, place, place, FAR_PRIOR, self._sigma_m, ITERATIONS)
        to_beat = self.score_to_beat(found)
        if not is_lost and _has_leapt(aim, other.pose):
            to_beat = max(to_beat, found.score + LEAP_BETTER)
        return other if other.score > to_beat else found


def _has_leapt(aim: _Aim, pose: Transform) -> bool:
    """Return whether a pose ``(3,)`` is farther from the prediction than odometry errs."""
    x, y = pose[0] - aim.start[0], pose[1] - aim.start[1]
    return bool(aim.prior[0, 0] * x * x + aim.prior[1, 1] * y * y > LEAP_SIGMAS**2)


def _aim(tiles: Tiles, points: NDArray[np.float64], start: Transform, guess: Guess) -> _Aim:
    prior = np.zeros((3, 3))  # filled one by one: np.diag takes four times as long
    prior[0, 0] = prior[1, 1] = 1.0 / guess.sigma_m**2
    prior[2, 2] = 1.0 / guess.sigma_rad**2
    return _Aim(tiles, points, start, prior)
