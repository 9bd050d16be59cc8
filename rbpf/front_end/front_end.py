"""Scan matching to the rolling map: the motion from every scan to the next, once for all particles.

It works in the rolling map's frame (``local``); what the filter takes from it is the motion between scans.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.elsewhere import TORN, TORN_LEAPT, Elsewhere, View
from mrslam.rbpf.front_end.local_matcher import BAD_INLIERS, BETTER, GOOD_INLIERS, LOST_INLIERS, NEAR_M, LocalMatcher
from mrslam.rbpf.front_end.prediction import DISBELIEVED, Guess, Predictor, are_apart, can_move, has_leapt
from mrslam.rbpf.front_end.rolling_map import RollingMap
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.poses import between, compose
from mrslam.spatial.runtime.crew import Crew
from mrslam.spatial.se2 import Transform

MOVED = 0.02
"""A robot whose wheels stand has moved if the score elsewhere is better by this."""
STOOD_M, STOOD_RAD = 0.3, 0.3
"""A robot that moved less than this in a pause sees most of what it saw before, metres and radians."""
CARRIED_S = 5.0
"""Nobody lifts, carries and puts down a robot in less, seconds."""
DOUBT_MEMORY, OFTEN_DOUBTED = 0.05, 0.1
"""Share of a new scan in ``FrontEnd._doubted``; above the second, a scan that fits badly is nothing unusual."""
REPLACED = 0.7
"""Share of what a robot sees after a pause that must contradict what it saw before for it to be elsewhere. Of robots
that were carried, 21 drives, it was 0.83 and more; of one that stood in a museum for a minute 0.56."""
ADRIFT_MEMORY = 0.1
"""Share of a new scan in ``FrontEnd.adrift``."""


@dataclass(frozen=True, eq=False)
class Step:
    """Motion of the base from the scan before to this one."""

    T_before_base: Transform
    """``(3,)``, metres and radians."""
    score: float
    """Mean log-likelihood of a beam relative to a perfect fit."""
    inliers: float
    """Share of beams that lie on the rolling map, 0..1."""
    blind_m: NDArray[np.float64]
    """``(2,)``, base frame, metres: along the direction where scans saw no motion, as long as the error expected."""
    guessed: NDArray[np.float64] = field(default_factory=lambda: np.zeros(2))
    """``(2,)``, variances of position and heading of a motion that was but guessed, m^2 and rad^2: its scan fitted
    nothing. 0 where it was matched."""
    is_carried: bool = False
    """Whether the robot was carried to where this scan was taken, nobody knows how far."""


class MatchedMap(Protocol):
    """What scans are matched to."""

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing in it yet."""

    def tiles_around(self, T_local_base: Transform) -> Tiles:
        """Return the map, with a window that holds all that can be seen from a pose ``(3,)``."""

    def is_due(self, T_local_base: Transform) -> bool:
        """Return whether a scan from this pose ``(3,)`` should be added."""

    def add(self, T_local_base: Transform, points: NDArray[np.float64]) -> None:
        """Take a scan's ``points (N, 5)`` as seen from a pose ``(3,)``."""

    def clear(self) -> None:
        """Forget what can be forgotten."""

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed map needs."""

    def restore(self, state: dict[str, Any]) -> None:
        """Become the map that was saved."""


class FrontEnd:
    """The rolling map, or a map that does not change, and the robot's pose in it."""

    def __init__(
        self,
        config: MapperConfig,
        crew: Crew | None = None,
        map_: MatchedMap | None = None,
        matcher: LocalMatcher | None = None,
    ) -> None:
        self._config = config
        self._map: MatchedMap = map_ or RollingMap(config)
        self._matcher = matcher or LocalMatcher(config.sigma_m, crew)
        self.predictor = Predictor(config.odometry_noise)
        self.T_local_base: Transform = np.zeros(3)
        """``(3,)``, metres and radians, in the rolling map's frame."""
        self.newest: Match | None = None
        """How the newest scan fitted; None where it was matched to nothing."""
        self.adrift = 0.0
        """0..1: moving average of how far motion was neither seen nor reported by odometry that proved right."""
        self._doubted = 0.0  # 0..1: moving average of scans that fitted much worse than usual
        self._view: View | None = None  # of the scan before, where most of that fitted
        self._elsewhere: Elsewhere | None = None  # where the robot may have been carried to

    def step(
        self,
        points: NDArray[np.float64],
        all_points: NDArray[np.float64],
        odom_motion: Transform | None,
        elapsed_s: float,
        origin: NDArray[np.float64],
        *,
        shown: Transform | None = None,
    ) -> Step:
        """Match a scan, and extend the rolling map.

        ``points (n, 5)`` are those of ``all_points (N, 5)`` to match; ``odom_motion (3,)`` is ``T_before_base``
        as odometry measured it since the scan before, which was taken ``elapsed_s`` earlier. ``origin (2,)`` : of the
        laser on the base, metres. ``shown (3,)`` : the motion, where a larger map surely shows the scan there; odometry
        leads there, too.
        """
        before, view = self.T_local_base, View(all_points.copy(), origin)
        if self._map.is_empty:
            self._map.add(before, all_points)
            self._view = view
            return Step(np.zeros(3), 0.0, 1.0, np.zeros(2))
        self.predictor.wait(elapsed_s)
        guess, found = self._best_of_guesses(points, odom_motion, is_confirmed=shown is not None)
        self.newest = found
        if shown is not None and self._does_not_reach(compose(before, shown), found):
            return self._begin_again(view, shown)
        if shown is None and elapsed_s >= CARRIED_S and self._was_carried(view, guess, found):
            return self._begin_again(view, np.zeros(3), is_carried=True)
        if self._is_elsewhere(points, view, guess, found, elapsed_s):
            return self._continue_elsewhere()
        self.T_local_base = found.pose
        motion = between(before, found.pose)
        self._learn(guess, motion, odom_motion, found)
        if self._map.is_due(found.pose):
            self._map.add(found.pose, all_points)
        return Step(motion, found.score, found.inliers, _blind_m(motion, guess.slip, found), _guessed(guess, found))

    def put_down(self, all_points: NDArray[np.float64], elapsed_s: float, origin: NDArray[np.float64]) -> Step:
        """Take the scan of a robot of which nobody knows where it is; arguments as for :meth:`step`."""
        self.predictor.wait(elapsed_s)
        return self._begin_again(View(all_points.copy(), origin), np.zeros(3), is_carried=True)

    def _does_not_reach(self, place: Transform, found: Match) -> bool:
        """Return whether this map does not reach a known place ``(3,)``: the scan hardly fits, or elsewhere."""
        return self._matcher.is_doubtful(found) and (found.inliers < BAD_INLIERS or are_apart(found.pose, place))

    def _was_carried(self, view: View, guess: Guess, found: Match) -> bool:
        """Return whether a robot that should still see what it saw before a pause sees something else.

        A scan that fits badly says so where scans usually fit. Where they do not, as of a robot that takes one a metre,
        most of what was seen before must be gone.
        """
        if not (self.predictor.is_after_pause and has_stood(guess.motion) and self._matcher.is_doubtful(found)):
            return False
        if self._doubted <= OFTEN_DOUBTED:
            return True
        if self._view is None:  # the scan before the pause fitted badly, too
            return found.inliers < LOST_INLIERS
        return view.contradiction(self._view, guess.motion) > REPLACED

    def _begin_again(self, view: View, motion: Transform, *, is_carried: bool = False) -> Step:
        """Begin another rolling map with this scan, after a motion ``(3,)`` that nothing in this one shows."""
        self._view, self._elsewhere = view, None
        self.T_local_base = compose(self.T_local_base, motion)
        self._map.clear()
        self._map.tiles_around(self.T_local_base)
        self._map.add(self.T_local_base, view.points)
        self.newest = None
        return Step(motion, 0.0, 1.0, np.zeros(2), is_carried=is_carried)

    def _is_elsewhere(
        self, points: NDArray[np.float64], view: View, guess: Guess, found: Match, elapsed_s: float
    ) -> bool:
        """Return whether it turned out that the robot was carried off while its laser saw, a few scans ago."""
        is_doubtful = self._matcher.is_doubtful(found)
        seen, self._view = self._view, None if found.inliers < BAD_INLIERS else view
        if self._elsewhere is not None:
            is_there = self._elsewhere.follow(points, view.points, guess, elapsed_s)
            if is_there is False:
                self._elsewhere = None
            return bool(is_there)
        if not isinstance(self._map, RollingMap):  # a map that does not change is no account of what was seen before
            return False
        if seen is not None and is_doubtful and self._saw_the_same(guess):
            motion = between(self.T_local_base, found.pose)
            is_possible = can_move(motion, elapsed_s)
            torn = TORN_LEAPT if has_leapt(guess.motion, motion) else TORN
            if not is_possible or view.contradiction(seen, motion) > torn:
                start = found.pose if is_possible else compose(self.T_local_base, guess.motion)
                self._elsewhere = Elsewhere(self._config, self._matcher.usual_score)
                self._elsewhere.begin(self._map, start, view.points)
        return False

    def _saw_the_same(self, guess: Guess) -> bool:
        """Return whether a robot that moved as guessed sees most of what it saw at the scan before."""
        return has_stood(guess.motion) and not self.predictor.is_after_pause

    def _continue_elsewhere(self) -> Step:
        """Continue in the rolling map of the place where the robot was put down."""
        assert self._elsewhere is not None
        there, before, self._elsewhere = self._elsewhere.there, self.T_local_base, None
        self._map, self.T_local_base = there.map, there.T_local_base
        return Step(between(before, there.T_local_base), 0.0, 1.0, np.zeros(2), is_carried=True)

    def knows(self, points: NDArray[np.float64], odom_motion: Transform | None) -> bool:
        """Return whether a scan fits what was seen before, where the robot is expected; nothing is learnt from it."""
        if self._map.is_empty:
            return False
        guess = self.predictor.predict(odom_motion)
        start = compose(self.T_local_base, guess.motion)
        return self._matcher.descend(self._map.tiles_around(start), points, start, guess).inliers >= BAD_INLIERS

    def _best_of_guesses(
        self, points: NDArray[np.float64], odom_motion: Transform | None, *, is_confirmed: bool
    ) -> tuple[Guess, Match]:
        """Return the guess of the motion that leads to the best match, and that match."""
        guess = self.predictor.predict(odom_motion)
        best = self._match(points, guess)
        stands = self.predictor.says_it_stands(odom_motion)
        to_beat = self._score_to_beat(best, stands)
        if is_confirmed or to_beat is None:
            return guess, best
        # A scan that fits nothing may score better than one that fits in part. And a robot that did not move in a pause
        # sees the same as before: a weaker fit may be any similar room.
        least = GOOD_INLIERS if self.predictor.is_after_pause else BAD_INLIERS
        for other in self.predictor.alternatives(odom_motion, guess.motion):
            found = self._match(points, other)
            is_there = found.inliers >= least
            if found.score > to_beat and is_there and not (stands and found.blind > 0.0):
                guess, best, to_beat = other, found, found.score
        return guess, best

    def _match(self, points: NDArray[np.float64], guess: Guess) -> Match:
        start = compose(self.T_local_base, guess.motion)
        return self._matcher.match(self._map.tiles_around(start), points, start, guess)

    def _score_to_beat(self, found: Match, stands: bool) -> float | None:
        """Return the score that another guess must exceed; None where the match leaves nothing to doubt.

        ``stands`` : whether odometry says that the robot stands.
        """
        if self._matcher.is_doubtful(found):
            # The others are ways to move, not places far off: they need not fit as usual. Nor need they fit much better
            # where walls do not show the odometry's: it may have jumped.
            return found.score + (0.0 if found.blind > 0.0 else BETTER)
        if stands:  # it sees the same as before, whoever walks past; but if it was moving, its wheels may have died
            return found.score + MOVED if self.predictor.was_moving else None
        if found.blind > 0.0:  # odometry may have jumped: where walls do not show it, the motion before is better
            return found.score - BETTER
        return None

    def _learn(self, guess: Guess, motion: Transform, odom_motion: Transform | None, found: Match) -> None:
        self._doubted += DOUBT_MEMORY * (float(self._matcher.is_doubtful(found)) - self._doubted)
        missed = between(guess.motion, motion)
        refuted = math.hypot(missed[0], missed[1]) > NEAR_M
        self.predictor.learn(motion, odom_motion, found, refuted=refuted)
        guessed = found.blind if guess.slip > DISBELIEVED else 0.0
        self.adrift += ADRIFT_MEMORY * (guessed - self.adrift)
        if found.inliers < LOST_INLIERS:
            self.adrift = 1.0

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed front end needs."""
        return {
            "map": self._map.state(), "T_local_base": self.T_local_base, "predictor": self.predictor.state(),
            "usual_score": self._matcher.usual_score, "doubted": self._doubted, "adrift": self.adrift,
            "view": None if self._view is None else list(self._view),
            "elsewhere": None if self._elsewhere is None else self._elsewhere.state(),
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the front end that was saved."""
        self._map.restore(state["map"])
        self.T_local_base = state["T_local_base"]
        self.predictor.restore(state["predictor"])
        self._matcher.usual_score, self._doubted, self.adrift = state["usual_score"], state["doubted"], state["adrift"]
        self._view = None if state["view"] is None else View(*state["view"])
        self._elsewhere = None
        if state["elsewhere"] is not None:
            self._elsewhere = Elsewhere(self._config, self._matcher.usual_score)
            self._elsewhere.restore(state["elsewhere"])


def has_stood(motion: Transform) -> bool:
    """Return whether a robot that moved by ``motion (3,)`` sees most of what it saw before."""
    return math.hypot(motion[0], motion[1]) < STOOD_M and abs(motion[2]) < STOOD_RAD


def _guessed(guess: Guess, found: Match) -> NDArray[np.float64]:
    """Return the variances ``(2,)`` of position and heading of a motion whose scan fits nothing, m^2 and rad^2, else 0.

    Outdoors such matches are off by three times what others are in heading, and by up to the guess's deviations.
    """
    is_lost = found.inliers < LOST_INLIERS
    return np.square([guess.sigma_m, guess.sigma_rad]) if is_lost else np.zeros(2)


def _blind_m(motion: Transform, slip: float, found: Match) -> NDArray[np.float64]:
    """Return the error ``(2,)`` to expect of a motion where the scan saw nothing of it, base frame after it, metres."""
    c, s = math.cos(found.pose[2]), math.sin(found.pose[2])
    along = c * found.blind_direction[0] + s * found.blind_direction[1]
    across = -s * found.blind_direction[0] + c * found.blind_direction[1]
    error = found.blind * slip * (motion[0] * along + motion[1] * across)
    return np.array([error * along, error * across])
