"""Telling places apart that fit nearly alike, where one of them must be the right one.

The share of the wall by which the best place leads shrinks as more is seen that looks the same; the wall does not.
"""

from __future__ import annotations

from dataclasses import replace

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.evidence import Evidence
from mrslam.alignment.prepared import prepare, working_resolution
from mrslam.alignment.result import Alignment, Rejection
from mrslam.alignment.verification.decide import MOST_RIVALS
from mrslam.alignment.verification.fits import margin_over, slid
from mrslam.alignment.verification.refine import covariance
from mrslam.alignment.verification.verify import examine, quick_case
from mrslam.spatial import OccupancyGrid

LEAD_M, DIFFERS_M = 2.0, 1.0
"""At every other place so much less wall agrees, and so much more contradicts, metres: a piece of furniture, or the end
of a corridor. Measured in hotels of which all is known: no such look at a wrong place."""
SPOTLESS_M = 0.3
"""And no more contradicts at the best one, metres: then nothing has changed there, and it may be the right one."""
CONFIDENCE = 0.6
"""Of an alignment that just passes: a second look must show more."""


def told_apart(a: OccupancyGrid, b: OccupancyGrid, outcome: Rejection, config: AlignmentConfig) -> Alignment | None:
    """Return an ambiguous outcome as an alignment at its best place, None where another one may be the right one."""
    if outcome.T_a_b is None or not 0 < len(outcome.rivals) < MOST_RIVALS:  # with as many there may be more
        return None
    one, two = a.cropped(), b.cropped()
    res = working_resolution(one, two, config)
    known_a, known_b = prepare(one, res), prepare(two, res)
    found = examine(known_a, known_b, outcome.T_a_b, config.tolerance_m)
    best = found.evidence
    others = [examine(known_a, known_b, T, config.tolerance_m).evidence for T in outcome.rivals]
    if best.contradicted_m > SPOTLESS_M or not all(_differs(best, other) for other in others):
        return None
    own = quick_case(known_a, known_b, outcome.T_a_b, config.tolerance_m)
    if margin_over(slid(known_a, known_b, found, config.tolerance_m), own) < config.min_margin:
        return None
    C = covariance(found.H, found.pivot, found.T_a_b, 0.5 * config.tolerance_m)
    evidence = replace(best, margin=0.0 if outcome.evidence is None else outcome.evidence.margin)
    return Alignment(outcome.T_a_b, CONFIDENCE, evidence, C, outcome.method)


def _differs(best: Evidence, other: Evidence) -> bool:
    """Return whether another place cannot be the right one if the best is."""
    is_less = best.matched_m - other.matched_m >= LEAD_M
    return is_less and other.contradicted_m - best.contradicted_m >= DIFFERS_M
