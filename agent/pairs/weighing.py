"""What encounters make of one alignment: they refuse a place that robots looked at in vain, and decide between places.

Maps propose, and whoever was there decides. A body at a place proves nothing alone: the maps must not contradict it.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.agent.pairs.hypotheses import LEAD_LLR, Hypotheses, Hypothesis
from mrslam.agent.pairs.loops import Loop
from mrslam.alignment import Alignment, Evidence, Rejection
from mrslam.alignment.stability import SAME_PLACE
from mrslam.spatial.se2 import Transform

SIGHT_METHOD = "sight"
"""Name of the method of an alignment that rests on robots which saw each other."""
LOOP_METHOD = "loop"
"""The same where third robots chose between places that fit alike."""
SIGHT_CONFIDENCE = 0.6
"""Its confidence: that of an alignment that just passes, so that any found by walls replaces it."""
SPREAD = np.diag([0.2**2, 0.2**2, 0.05**2])
"""Covariance of a supported place whose maps were not fitted, m^2 and rad^2: what a body may stand beside its place,
and the angle of that seen from 4 m."""
FORGIVEN_M, FORGIVEN_SHARE = 2.0, 0.3
"""Walls of two maps may lie on the other's free floor by so many metres, or by this share of those that agree, at a
place where robots saw each other: ghosts that teammates leave in maps, and ``merge.contradiction_share``."""
FITTED_M = 5.0
"""Walls that agree from which the maps say better than two robots where they lie, metres."""


def weighed(places: Hypotheses, outcome: Alignment | Rejection, loops: Sequence[Loop] = ()) -> Alignment | Rejection:
    """Return an alignment's outcome as encounters leave it; third robots (``loops``) only help to choose a place."""
    if outcome.T_a_b is None:
        return outcome
    if isinstance(outcome, Alignment):
        objection = against(places, outcome.T_a_b)
        return outcome if objection is None else refused(outcome, objection.words)
    here = places.at(outcome.T_a_b)
    if here is not None and here is places.supported and agrees(outcome.evidence):
        return by_sight(here, outcome)
    return _decided(places, outcome, loops) if outcome.ambiguous else outcome


class Objection(NamedTuple):
    """What was seen that speaks against a place of two robots."""

    llr: float
    """How much, nats, 0 or more."""
    words: str


def against(places: Hypotheses, T_a_b: Transform, robots: str = "the robots") -> Objection | None:
    """Return what was seen that speaks most against a place of two robots, or None.

    They looked for each other and nobody was there, or they rather saw each other elsewhere. It keeps alignments from
    being believed, and withdraws those that are.
    """
    found = []
    here, ahead = places.at(T_a_b), places.ahead_of(T_a_b)
    if here is not None and here.is_doubted:
        words = f"{robots} looked where the other should be, and nobody was there ({here.llr:.1f} nats)"
        found.append(Objection(-here.llr, words))
    if ahead is not None:
        x, y, _ = ahead.T_a_b
        words = f"{robots} saw each other with the maps {x:.1f}, {y:.1f} m apart, which is not here"
        found.append(Objection(ahead.llr, words))
    return max(found, key=lambda one: one.llr, default=None)


def _decided(places: Hypotheses, outcome: Rejection, loops: Sequence[Loop]) -> Alignment | Rejection:
    """Return the place of those that fit alike where the robots saw each other, by sightings and loops if need be.

    That all others were refuted chooses none: where maps fit alike at several places the building repeats itself, and
    the right place may be one that neither map shows yet.
    """
    fits = [T for T in (outcome.T_a_b, *outcome.rivals) if T is not None]
    left = [T for T in fits if (place := places.at(T)) is not None and place is places.supported]
    if not left:
        left = _chosen(places, fits, loops)
    if len(left) != 1 or outcome.evidence is None:
        return outcome
    method = LOOP_METHOD if any(SAME_PLACE.is_near(loop.T_a_b, left[0]) for loop in loops) else SIGHT_METHOD
    return Alignment(left[0], SIGHT_CONFIDENCE, outcome.evidence, SPREAD, method)


def _chosen(places: Hypotheses, fits: list[Transform], loops: Sequence[Loop]) -> list[Transform]:
    """Return the place for which sightings and loops speak, by ``LEAD_LLR`` more than for any other; alone, or nothing.

    Loops say nothing for a place where robots looked in vain.
    """
    ranked = []
    for k, T_a_b in enumerate(fits):
        place = places.at(T_a_b)
        is_refuted = place is not None and place.is_refuted
        closed = sum(loop.llr for loop in loops if not is_refuted and SAME_PLACE.is_near(loop.T_a_b, T_a_b))
        ranked.append(((0.0 if place is None else place.llr) + closed, k))
    ranked.sort(reverse=True)
    (best, k), (second, _) = ranked[:2]
    return [fits[k]] if best > 0.0 and best - second >= LEAD_LLR else []


def is_worth_keeping(outcome: Alignment | Rejection) -> bool:
    """Return whether a place that maps propose is one to look at: enough wall agrees there, and little contradicts."""
    wall = outcome.evidence
    return outcome.accepted or (wall is not None and wall.matched_m >= FITTED_M and agrees(wall))


def agrees(evidence: Evidence | None) -> bool:
    """Return whether nothing in two maps speaks against the place at which they were examined."""
    if evidence is None:
        return True
    return evidence.contradicted_m <= max(FORGIVEN_M, FORGIVEN_SHARE * evidence.matched_m)


def by_sight(place: Hypothesis, outcome: Rejection) -> Alignment:
    """Return the alignment of maps at a place where the robots saw each other, though they show too little of it."""
    evidence = outcome.evidence or Evidence()
    T_a_b: Transform = place.T_a_b
    if outcome.T_a_b is not None and evidence.matched_m >= FITTED_M and place.is_at(outcome.T_a_b):
        T_a_b = outcome.T_a_b
    return Alignment(T_a_b, SIGHT_CONFIDENCE, evidence, covariance_of(place), SIGHT_METHOD)


def covariance_of(place: Hypothesis) -> NDArray[np.float64]:
    """Return the covariance ``(3, 3)`` of a supported place, m^2 and rad^2: that of the sightings that propose it."""
    return SPREAD if place.fix is None else place.fix.covariance


def refused(outcome: Alignment, reason: str) -> Rejection:
    """Return the rejection of an alignment for this reason."""
    return Rejection(reason, outcome.confidence, outcome.evidence, outcome.method, outcome.T_a_b)
