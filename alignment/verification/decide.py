"""From candidates to an answer: refine, examine, compare with the next best distinct fit, accept or say why not."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.result import Alignment, Candidate, Rejection
from mrslam.alignment.verification.reasons import Test, tests
from mrslam.alignment.verification.refine import covariance, refine
from mrslam.alignment.verification.verify import DISCOUNT, Agreement, Case, examine, quick_case
from mrslam.spatial import se2

Fit = tuple[Case, se2.Transform, Candidate]
"""A refined candidate: what speaks for and against it, where b lies, where it came from."""
SAME_M, SAME_RAD = 0.4, math.radians(4.0)
"""Two fits nearer than this, at the middle of b's walls, are one fit."""
CLEANEST, LEFT = 0.1, 0.78
"""Beside a best fit without stain so much contradiction per metre makes a rival e times less worth; what it keeps."""
SLIDES_M = (-3.0, -1.5, -0.75, 0.75, 1.5, 3.0)
"""How far the best fit is slid along its walls to see whether it fits there as well, metres."""


def rivalry(best: Case, rival: Case) -> float:
    """Return how near a distinct other fit comes to the best one, 0..1 and more.

    Maps that hardly contradict each other at one place would not do so at their true place either: the cleaner the best
    fit, the more a rival's contradictions count, but never so much that it loses more than a share of its worth. And a
    rival is no nearer to the best than the balance of what speaks for and against it.
    """
    discount = min(max(3.0 * best.contradicted_m / max(best.matched_m, 0.1), CLEANEST), DISCOUNT)
    near = max(rival.worth(discount) / max(best.worth(discount), 1e-3), LEFT * rival.worth() / max(best.worth(), 1e-3))
    return min(near, max(rival.balance, 0.0) / max(best.balance, 1e-3))


def slid(a: PreparedMap, b: PreparedMap, best: Agreement, tolerance_m: float) -> list[Case]:
    """Return what speaks for and against the fit slid in the direction that its walls hold least."""
    along = np.linalg.eigh(best.H[:2, :2])[1][:, 0]
    return [quick_case(a, b, best.T_a_b + np.append(d * along, 0.0), tolerance_m) for d in SLIDES_M]


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
        if any(same(b, candidate.T_a_b, T) for _, T, _ in fits):
            continue
        T_a_b = refine(a, b, candidate.T_a_b)
        if any(same(b, T_a_b, T) for _, T, _ in fits):
            continue
        fits.append((quick_case(a, b, T_a_b, config.tolerance_m, most_cells=math.inf), T_a_b, candidate))
    fits.sort(key=lambda fit: -fit[0].worth())
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
    own, T_a_b, candidate = fits[0]
    best = examine(a, b, T_a_b, config.tolerance_m)
    evidence = {**candidate.evidence, **best.evidence, "score_m": own.worth()}
    aside = slid(a, b, best, config.tolerance_m)

    def judged(others: list[Fit]) -> list[Test]:
        known = aside + [rival for rival, _, _ in others]
        evidence["margin"] = max(0.0, 1.0 - max(rivalry(own, rival) for rival in known))
        return tests(evidence, config)

    asked = judged(fits[1:])
    if rivals is not None and all(t.slack >= 0 for t in asked):
        more = [fit for fit in fits_of(a, b, rivals(), config) if not same(b, fit[1], best.T_a_b)]
        asked = judged(fits[1:] + more)
    confidence = 1.0 / (1.0 + math.exp(-max(-30.0, min(t.slack for t in asked))))
    failed = list(dict.fromkeys(t.complaint for t in asked if t.slack < 0))
    if not failed and confidence >= config.min_confidence:
        C = covariance(best.H, best.pivot, best.T_a_b, 0.5 * config.tolerance_m)
        return Alignment(best.T_a_b, confidence, evidence, C, method)
    if not failed:
        failed.append(f"confidence {confidence:.3f}, at least {config.min_confidence:g} is asked for")
    if "matches" in evidence:
        failed.append(f"{evidence['inliers']:.0f} of {evidence['matches']:.0f} matched features agree")
    failed.append(f"the best guess overlaps {evidence['overlap']:.0%} of the smaller map")
    return Rejection("; ".join(failed), confidence, evidence, method, best.T_a_b)
