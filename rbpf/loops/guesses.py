"""Histories of a robot that lost its place: each guesses where it really is, and weighs what it explains.

Between two keyframes everything is known but a few decisions: which old place the newest stretch of way is on, or none
that is known. Given them, trajectory and map follow in closed form, so a history is its decision: a pose, and a weight

    w(place) = p(place) * prod_k p(z_k | m, place),    p(z | m, x) = exp(EVIDENCE * mean log-likelihood of a beam)

with the scans z_k matched at x, the same prior for all places within what may have drifted, and for the history in
which the place is new ``exp(EVIDENCE * NEW)`` for each scan: what a map that knows nothing says of it. All the
histories there are within the bound are enumerated, so weights are exact where a sampled filter would draw them, and
what resampling would not copy is dropped.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.matching.beam_sums import UNKNOWN_COST
from mrslam.spatial.matching.gauss_newton import Match
from mrslam.spatial.se2 import Transform

NEW = -UNKNOWN_COST
"""Mean log-likelihood of a beam where the map knows nothing, relative to a perfect fit."""
LIGHT = math.log(1e3)
"""A history this much lighter than the best is dropped, log weight: no particle of a thousand would be drawn to it."""
DISAGREE_MOST = 2
"""Stretches that may not fit."""


class Fit(NamedTuple):
    """A keyframe that saw the place of an old one."""

    old: int
    new: int
    found: Match
    """Its pose is of ``new`` in the frame of ``old``."""


@dataclass(eq=False)
class Guess:
    """One history."""

    fits: list[Fit]
    """Stretches that agree on it; never empty."""
    disagreed: int = 0
    """Number of stretches that do not."""
    log_weight: float = 0.0
    """Relative to the history in which the place is new."""
    T_map_newest: Transform = field(default_factory=lambda: np.zeros(3))
    """``(3,)``, where it has the newest keyframe that was asked."""
    agrees: bool = True
    """Whether what that saw fits there; along a corridor it may fit elsewhere, too."""

    @property
    def is_refuted(self) -> bool:
        """Whether too much contradicts it."""
        return self.disagreed > max(DISAGREE_MOST, len(self.fits) // 2)

    def explain(self, found: Match, evidence_beams: float) -> None:
        """Weigh a scan that was matched where this history has the robot."""
        self.log_weight += evidence_beams * (found.score - NEW)

    def state(self) -> list[Any]:
        """Return everything that a resumed search needs."""
        fits = [[fit.old, fit.new, list(fit.found)] for fit in self.fits]
        return [fits, self.disagreed, self.log_weight, self.T_map_newest, self.agrees]

    @classmethod
    def of(cls, state: list[Any]) -> Guess:
        """Return the guess whose :meth:`state` this is."""
        return cls([Fit(old, new, Match(*found)) for old, new, found in state[0]], *state[1:])


def score_of_known(found: Match) -> float:
    """Return the mean log-likelihood of a beam where those that end in what the map does not know say nothing."""
    return found.score - NEW * (1.0 - found.inliers - found.conflicts)


def shares(guesses: Sequence[Guess]) -> NDArray[np.float64]:
    """Return the posterior ``(G,)`` of each history; what is missing to 1 is that of the place being new."""
    logs = np.array([0.0, *(guess.log_weight for guess in guesses)])
    weights = np.exp(logs - logs.max())
    return np.asarray(weights[1:] / weights.sum())


def distinct(guesses: Sequence[Guess], within_m: float, within_rad: float) -> list[Guess]:
    """Return the histories without those that lead to the place of one in which more fits: they are one decision."""
    kept: list[Guess] = []
    for guess in sorted(guesses, key=lambda guess: (-len(guess.fits), -guess.log_weight)):
        apart = (se2.difference(guess.T_map_newest, other.T_map_newest) for other in kept)
        if all(away_m > within_m or turned > within_rad for away_m, turned in apart):
            kept.append(guess)
    return kept


def surviving(guesses: Sequence[Guess], most: int) -> list[Guess]:
    """Return the heaviest ``most`` histories, without those refuted or too light for any of ``most`` particles."""
    alive = sorted((guess for guess in guesses if not guess.is_refuted), key=lambda guess: -guess.log_weight)[:most]
    best = max([0.0, *(guess.log_weight for guess in alive)])  # of a place that is new: 0
    return [guess for guess in alive if guess.log_weight > best - LIGHT]
