"""From candidates to an answer: refine, examine, compare with the next best distinct fit, accept or say why not."""

from __future__ import annotations

import math
from collections.abc import Callable

from alignment.config import AlignmentConfig
from alignment.prepared import PreparedMap
from alignment.reasons import Test, against, matched_m, tests
from alignment.refine import covariance, refine
from alignment.result import Alignment, Candidate, Rejection
from alignment.verify import Agreement, examine
from spatial import se2

Fit = tuple[float, Agreement, Candidate]
"""A refined candidate: score (m), what the maps say of it, where it came from."""
SAME_M, SAME_RAD = 0.4, math.radians(4.0)
"""Two fits nearer than this, at the middle of b's walls, are one fit."""


HELD = 0.15
"""Share of the matched wall that runs across, from which a fit is held in every direction."""
RICH_WALL_M, RICH_WALLS, SPOTLESS = 40.0, 8, 0.01
"""A fit of so much wall, on so many distinct walls and so clean, lets rivals be judged by how clean they are."""
CLEAN, DIRTY = 0.02, 0.03
"""So much more contradiction than the best fit's is chance; each further so much makes a rival e times less likely."""


def fit_score(evidence: dict[str, float]) -> float:
    """Return metres of wall that speak for a fit, less what speaks against it.

    A metre of contradiction undoes three; walls that face away from each other may be two sides of one.
    """
    good = min(evidence["matched_a_m"], evidence["matched_b_m"])
    bad = max(evidence["contradicted_a_m"], evidence["contradicted_b_m"])
    odd = max(evidence["opposed_a_m"], evidence["opposed_b_m"])
    return good - 3.0 * bad - 0.2 * odd


def standing(score_m: float, evidence: dict[str, float]) -> float:
    """Return the score as a rival's: a fit that can slide along its walls explains little, however much wall it has."""
    return max(score_m, 0.0) * min(1.0, evidence["crosswise_m"] / matched_m(evidence) / HELD)


def dirt(evidence: dict[str, float]) -> float:
    """Return the contradiction of a fit per metre of agreeing wall; clear contradiction counts thrice."""
    shallow, deep = against(evidence)
    return 0.5 * shallow + deep


def rivalry(best: dict[str, float], score_m: float, evidence: dict[str, float]) -> float:
    """Return what a distinct other fit's standing is worth beside the best one.

    Maps that contradict each other nowhere at one place would not do so at their true place either: beside a rich fit
    without stain a rival loses weight with its own stains.
    """
    worth = standing(score_m, evidence)
    if matched_m(best) < RICH_WALL_M or best["walls"] < RICH_WALLS or dirt(best) > SPOTLESS:
        return worth
    return worth * math.exp(-max(0.0, dirt(evidence) - dirt(best) - CLEAN) / DIRTY)


def same(b: PreparedMap, T_1: se2.Transform, T_2: se2.Transform) -> bool:
    """Whether two transforms lay b at one place."""
    if abs(math.remainder(T_1[2] - T_2[2], 2.0 * math.pi)) >= SAME_RAD:
        return False
    apart = se2.apply(T_1, b.centre) - se2.apply(T_2, b.centre)
    return math.hypot(apart[0], apart[1]) < SAME_M


def fits_of(a: PreparedMap, b: PreparedMap, candidates: list[Candidate], config: AlignmentConfig) -> list[Fit]:
    """Return the distinct fits the candidates lead to with their scores, best first."""
    fits: list[Fit] = []
    for candidate in candidates:
        if len(fits) == config.max_candidates:
            break
        if any(same(b, candidate.T_a_b, found.T_a_b) for _, found, _ in fits):
            continue
        T_a_b = refine(a, b, candidate.T_a_b)
        if any(same(b, T_a_b, found.T_a_b) for _, found, _ in fits):
            continue
        found = examine(a, b, T_a_b, config.tolerance_m)
        fits.append((fit_score(found.evidence), found, candidate))
    fits.sort(key=lambda fit: -fit[0])
    return fits


def decide(
    a: PreparedMap,
    b: PreparedMap,
    candidates: list[Candidate],
    method: str,
    config: AlignmentConfig,
    rivals: Callable[[], list[Candidate]] | None = None,
) -> Alignment | Rejection:
    """Return the best candidate as an alignment where it passes every test, else a rejection that says why.

    ``rivals`` is asked for further candidates, to beat the best one but not to be accepted, once it would be accepted.
    """
    if not candidates:
        return Rejection("nothing in the two maps matches", 0.0, {}, method)
    fits = fits_of(a, b, candidates, config)
    score, best, candidate = fits[0]
    own = standing(score, best.evidence)
    evidence = {**candidate.evidence, **best.evidence, "score_m": score}

    def judged(others: list[Fit]) -> list[Test]:
        second = max((rivalry(best.evidence, other, found.evidence) for other, found, _ in others), default=0.0)
        evidence["margin"] = max(0.0, 1.0 - second / own) if own > 0 else 0.0
        return tests(evidence, config)

    asked = judged(fits[1:])
    if rivals is not None and all(t.slack >= 0 for t in asked):
        more = [fit for fit in fits_of(a, b, rivals(), config) if not same(b, fit[1].T_a_b, best.T_a_b)]
        asked = judged(fits[1:] + more)
    confidence = 1.0 / (1.0 + math.exp(-max(-30.0, min(t.slack for t in asked))))
    failed = list(dict.fromkeys(t.complaint for t in asked if t.slack < 0))
    if not failed and confidence >= config.min_confidence:
        C = covariance(best.H, best.pivot, best.T_a_b, 0.5 * config.tolerance_m)
        return Alignment(best.T_a_b, confidence, evidence, C, method)
    if not failed:
        failed.append(f"confidence {confidence:.2f}, at least {config.min_confidence:g} is asked for")
    if "matches" in evidence:
        failed.append(f"{evidence['inliers']:.0f} of {evidence['matches']:.0f} matched features agree")
    failed.append(f"the best guess overlaps {evidence['overlap']:.0%} of the smaller map")
    return Rejection("; ".join(failed), confidence, evidence, method, best.T_a_b)
