"""Places seen again after a long way, when nobody knows any more where they should be.

The newest stretch of way is looked for in the whole map within what may have drifted. One fit is a guess; it is
followed along the way, and believed when enough stretches have agreed with it, none of them along a corridor, and no
other place explains them as well. Where several places fit, each is a history that is followed (:mod:`.guesses`), as
many as there may be particles.
"""

from __future__ import annotations

import math
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.loops.drift import Drift
from mrslam.rbpf.loops.guesses import DISAGREE_MOST, LIGHT, Fit, Guess, distinct, score_of_known, shares, surviving
from mrslam.rbpf.loops.kept_scans import KeptScans
from mrslam.rbpf.loops.stretch_search import SHARE_LEAST, STRETCH, places_of
from mrslam.spatial import se2
from mrslam.spatial.matching import places
from mrslam.spatial.matching.branch_and_bound import CELL_M
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.se2 import Transform

EVERY_M, CARRIED_EVERY_M = 8.0, 2.0
"""The map is searched after this much way, and where the robot was carried."""
BEGUN_MOST = 16
"""Most guesses that begin at once."""
CONFIRM_M = 2.0
"""A guess is asked for again after this much way."""
FOUND_WITHIN_M, FOUND_WITHIN_RAD = 0.5, 0.08
"""Later stretches must fit within this of where the guess puts them, metres and radians."""
NEAR_M = 4.0
"""They say nothing where no old keyframe was nearer, metres."""
LOST_M = 5.0
"""Way that drifts between two questions, metres: what is searched around the guess."""
AGREE_LEAST = 5
"""Stretches that must fit."""
SURE = 0.99
"""Least posterior of a history that is believed."""
EXTENT_LEAST_M = 5.0
"""They span at least this, metres, along one axis: a place, not a spot."""
ASKED_MOST = 12
"""Most keyframes asked about before that a new guess is asked about, too: some 24 m of way."""
QUIET_MOST_M = 25.0
"""A guess is given up where nothing spoke for it on this much way."""
RIVAL = 0.9
"""Another place that fits this share of what the guess does makes it ambiguous: of a lost robot that may follow several
histories, where what was asked of late does not contradict it."""
LEAD = math.log(SURE / (1.0 - SURE))
"""It does where its log-likelihood is less by this. In 25 drives of robots carried in hotels a wrong place was more
likely than the true one by 1.7 at most; by 6.5 if what the map does not know spoke against places."""


class Compare(Protocol):
    """Matches the newest keyframes to the place of an old one."""

    def __call__(self, T_map_key: Transform, old: int, T_old_new: Transform, lost_m: float) -> Match:
        """Return where the newest keyframe lies in the frame of the ``old`` one."""


class FarSearch:
    """The histories of where the robot really is."""

    def __init__(self, scans: KeptScans, compare: Compare, evidence_beams: float, most: int) -> None:
        """Follow at most this number of histories; ``evidence_beams`` : independent beams that a scan weighs as."""
        self._scans, self._compare = scans, compare
        self._evidence_beams, self.most = evidence_beams, most
        self._searched_m = 0.0  # way at the newest search
        self.guesses: list[Guess] = []
        """Histories that are followed."""
        self._asked_m = 0.0  # way at the newest question
        self._asked: list[int] = []  # keyframes that the guesses were asked about

    def drop(self) -> None:
        """Give all guesses up."""
        self.guesses, self._asked = [], []

    def rest(self) -> None:
        """Ask again after ``EVERY_M``: nothing can be far off now."""
        self.drop()
        self._searched_m = float(self._scans.way_m[-1])

    def is_due(self, is_carried: bool) -> bool:
        """Return whether there is something to ask at the newest keyframe."""
        way_m = float(self._scans.way_m[-1])
        if self.guesses:
            return way_m - self._asked_m >= CONFIRM_M
        return way_m - self._searched_m >= (CARRIED_EVERY_M if is_carried else EVERY_M)

    def look(self, T_map_key: Transform, old: NDArray[np.int64], drift: Drift) -> list[Fit]:
        """Ask the newest of the keyframes ``(K, 3)``; return the fits that are believed, or none.

        ``old (n,)`` : keyframes that may have seen its place, whose scans are kept. ``drift`` : how far off the newest
        may be.
        """
        self._asked_m = float(self._scans.way_m[-1])
        self._asked = [*self._asked[-ASKED_MOST:], T_map_key.shape[0] - 1]
        for guess in self.guesses:
            self._follow(guess, T_map_key, old)
        self.guesses = surviving(distinct(self.guesses, FOUND_WITHIN_M, FOUND_WITHIN_RAD), self.most)
        if not self.guesses and not drift.is_unknown:
            self._asked = []
        believed = self._believed(T_map_key, old, drift)
        is_due = self._asked_m - self._searched_m >= EVERY_M and drift.is_unknown and len(self.guesses) < self.most
        if not self.guesses or (is_due and not believed):
            self._guess(T_map_key, old, drift)
        return believed

    def _guess(self, T_map_key: Transform, old: NDArray[np.int64], drift: Drift) -> None:
        """Begin a history for every place that the newest stretch fits about as well as the best one."""
        self._searched_m = self._asked_m
        known = [guess.T_map_newest for guess in self.guesses]
        most = min(self.most - len(self.guesses), BEGUN_MOST if drift.is_unknown else 1)
        for spot in places_of(self._scans, T_map_key, old, drift, STRETCH, known, most=most).spots:
            fit = self._verified(T_map_key, old, spot.T_map_scan)
            if fit is not None and places.fits(fit.found) and fit.found.blind == 0.0:
                guess = Guess([fit], T_map_newest=se2.compose(T_map_key[fit.old], fit.found.pose))
                guess.explain(fit.found, self._evidence_beams)
                self._explain_before(guess, T_map_key, old)
                self.guesses.append(guess)

    def _explain_before(self, guess: Guess, T_map_key: Transform, old: NDArray[np.int64]) -> None:
        """Weigh a new history by what was asked of the others before: all are weighed by the same scans."""
        best = max((other.log_weight for other in self.guesses), default=0.0)
        newest = T_map_key.shape[0] - 1
        for k, key in enumerate(reversed(self._asked)):
            most = (len(self._asked) - k) * self._evidence_beams
            if key == newest or key not in self._scans.points or guess.log_weight + most < best - LIGHT:
                continue
            found = self._seen_then(guess.T_map_newest, key, T_map_key, old)
            if found is not None:
                guess.explain(found, self._evidence_beams)

    def _seen_then(
        self, T_map_newest: Transform, key: int, T_map_key: Transform, old: NDArray[np.int64]
    ) -> Match | None:
        """Return how an earlier keyframe fits if the newest is at ``T_map_newest (3,)``; None: nothing old is near."""
        T_map_then = se2.compose(T_map_newest, se2.between(T_map_key[-1], T_map_key[key]))
        fit = self._verified(T_map_key[: key + 1], old[old <= key], T_map_then)
        return None if fit is None else fit.found

    def _follow(self, guess: Guess, T_map_key: Transform, old: NDArray[np.int64]) -> None:
        """Ask the newest keyframe whether it agrees with a guess."""
        last = guess.fits[-1]
        if self._scans.way_m[-1] - self._scans.way_m[last.new] > QUIET_MOST_M:
            guess.disagreed = DISAGREE_MOST + len(guess.fits)
            return
        T_map_last = se2.compose(T_map_key[last.old], last.found.pose)
        expected = se2.compose(T_map_last, se2.between(T_map_key[last.new], T_map_key[-1]))
        guess.T_map_newest, guess.agrees = expected, False
        fit = self._verified(T_map_key, old, expected)
        if fit is None:
            return
        guess.explain(fit.found, self._evidence_beams)
        guess.agrees = places.fits(fit.found)
        if fit.found.blind > 0.0:
            guess.disagreed += places.is_contradicted(fit.found)
            return
        T_map_found = se2.compose(T_map_key[fit.old], fit.found.pose)
        away_m, turned = se2.difference(T_map_found, expected)
        drifted = places.DRIFT_M_PER_M * (self._scans.way_m[-1] - self._scans.way_m[last.new])
        guess.agrees &= away_m <= FOUND_WITHIN_M + drifted and turned <= FOUND_WITHIN_RAD
        if guess.agrees:
            guess.fits.append(fit)
            guess.T_map_newest = T_map_found
        else:
            guess.disagreed += 1

    def _verified(self, T_map_key: Transform, old: NDArray[np.int64], T_map_new: Transform) -> Fit | None:
        """Match the newest keyframe where it may be, ``(3,)``; None where nothing old is near."""
        away_m = np.hypot(*(T_map_key[old, :2] - T_map_new[:2]).T)
        turned = np.abs(se2.wrap(T_map_key[old, 2] - T_map_new[2]))
        k = int(np.argmin(away_m + places.TURN_COST_M * turned))
        if away_m[k] > NEAR_M:
            return None
        nearest = int(old[k])
        found = self._compare(T_map_key, nearest, se2.between(T_map_key[nearest], T_map_new), LOST_M)
        return Fit(nearest, T_map_key.shape[0] - 1, found)

    def _believed(self, T_map_key: Transform, old: NDArray[np.int64], drift: Drift) -> list[Fit]:
        """Return the fits of the heaviest history once they are enough and no other place explains what they saw."""
        if not self.guesses:
            return []
        best = int(np.argmax(shares(self.guesses)))
        guess = self.guesses[best]
        fits = guess.fits
        if len(fits) < AGREE_LEAST or guess.disagreed > len(fits) // 2 or shares(self.guesses)[best] < SURE:
            return []
        if np.ptp(T_map_key[[fit.new for fit in fits], :2], axis=0).max() < EXTENT_LEAST_M:
            return []
        if not guess.agrees or self._is_ambiguous(guess, T_map_key, old, drift):
            return []
        self.drop()
        return fits

    def _is_ambiguous(self, guess: Guess, T_map_key: Transform, old: NDArray[np.int64], drift: Drift) -> bool:
        """Return whether all that was seen since the first fit would be seen elsewhere, too."""
        there = guess.T_map_newest
        count = T_map_key.shape[0] - 1 - guess.fits[0].new + STRETCH
        here = places_of(self._scans, T_map_key, old, Drift(2.0 * CELL_M, 0.06), count, [], there).spot
        least = RIVAL * (SHARE_LEAST if here is None else here.share)
        most = min(self.most, BEGUN_MOST) if drift.is_unknown else 1
        rivals = places_of(self._scans, T_map_key, old, drift, count, [there], share_least=least, most=most)
        if len(rivals.spots) == most or (drift.is_unknown and not rivals.is_complete):
            return True
        as_likely = self._log_likelihood(there, T_map_key, old) - LEAD
        return any(self._log_likelihood(spot.T_map_scan, T_map_key, old) > as_likely for spot in rivals.spots)

    def _log_likelihood(self, T_map_newest: Transform, T_map_key: Transform, old: NDArray[np.int64]) -> float:
        """Return that of what was asked of late, if the newest keyframe is at ``T_map_newest (3,)``.

        What the map does not know there says nothing: of equal rooms the one that was seen best explains more beams.
        """
        asked = (key for key in self._asked if key in self._scans.points)
        found = (self._seen_then(T_map_newest, key, T_map_key, old) for key in asked)
        return self._evidence_beams * sum(score_of_known(fit) for fit in found if fit is not None)

    def state(self) -> list[Any]:
        """Return everything that a resumed search needs."""
        return [self._searched_m, self._asked_m, list(self._asked), [guess.state() for guess in self.guesses]]

    def restore(self, state: list[Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self._searched_m, self._asked_m, self._asked = state[:3]
        self.guesses = [Guess.of(guess) for guess in state[3]]
