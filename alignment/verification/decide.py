"""From candidates to an answer: refine, examine, compare with the next best distinct fit, accept or say why not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.evidence import Evidence
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.result import Alignment, Candidate, Rejection
from mrslam.alignment.verification.bent_fits import BentFit, bent_fits
from mrslam.alignment.verification.fits import Fit, fits_of, margin_over, rivalry, same, slid
from mrslam.alignment.verification.reasons import CLEAN, Test, bent_bounds, tests
from mrslam.alignment.verification.refine import carried, covariance
from mrslam.alignment.verification.verify import Agreement, Case, examine
from mrslam.spatial.se2 import Transform

Rival = tuple[Case, Transform]
"""Another place: what speaks for and against it, where b lies there."""
MOST_RIVALS = 4
"""Rivals named in an ambiguous answer; with the best fit five places."""

OVERTHROWS = 0.75
"""Rivalry of a bent place from which it makes a fit that needed no bending ambiguous. Where the bent place is the right
one it is 1.5 and more (half a turn, ragged maps); where it is not, 0.54 at most: every place gains by bending."""


@dataclass(frozen=True, eq=False)
class Claim:
    """A fit put forward as the answer: what it shows, and what is asked of it."""

    found: Agreement
    own: Case
    """What speaks for and against it, to be compared with its rivals."""
    evidence: Evidence
    judged: list[Test]
    rivals: list[Rival]
    """Distinct other places, compared with ``own``."""

    @property
    def passed(self) -> bool:
        """Whether it shows all that is asked."""
        return all(test.slack >= 0 for test in self.judged)

    @property
    def lacks_lead(self) -> bool:
        """Whether it shows all that is asked but a lead over its rivals."""
        return all((test.slack < 0) == test.is_lead for test in self.judged)

    def against(self, rivals: list[Rival], config: AlignmentConfig, own: Case | None = None) -> Claim:
        """Return the claim judged with further rivals; ``own`` : the fit's case to compare these with."""
        margin = min(self.evidence.margin, margin_over([case for case, _ in rivals], own or self.own))
        evidence = replace(self.evidence, margin=margin)
        return replace(self, evidence=evidence, judged=tests(evidence, config), rivals=self.rivals + rivals)


def decide(
    a: PreparedMap,
    b: PreparedMap,
    candidates: list[Candidate],
    method: str,
    config: AlignmentConfig,
    rivals: Callable[[], list[Candidate]] | None = None,
) -> Alignment | Rejection:
    """Return the best candidate as an alignment where it passes every test, else a rejection that says why.

    ``rivals`` is called for further candidates, to beat the best one but not to be accepted, once it would be accepted.
    Where the maps do not fit as they are, or not cleanly, they are bent to fit at every place, and judged again.
    """
    if not candidates:
        return Rejection("nothing in the two maps matches", 0.0, None, method)
    fits = fits_of(a, b, candidates, config)
    proposed = len(fits)
    claim = rigid_claim(a, b, fits, config)
    if rivals is not None:
        if not claim.passed:
            return answer(claim, method, config)
        further = [fit for fit in fits_of(a, b, rivals(), config) if not same(b, fit[1], fits[0][1])]
        fits += further
        claim = claim.against([(case, T) for case, T, _ in further], config)
    is_clean = claim.passed and claim.evidence.contradicted_per_m <= CLEAN
    if config.strain == 0.0 or is_clean:
        return answer(claim, method, config)
    bent = bent_fits(a, b, [T for _, T, _ in fits], config)
    if not claim.passed:
        if bent[0].start >= proposed:  # a rival once more: it is not to be accepted
            return answer(claim, method, config)
        other = bent_claim(a, b, bent, config)
        return answer(other if other.passed or other.lacks_lead else claim, method, config)
    own = next((fit for fit in bent if fit.start == 0), None)
    if own is None:  # bent, another place leads to this one and fits better: one place
        return answer(claim, method, config)
    others = [(fit.case, fit.bend.T_a_b) for fit in bent if fit is not own and rivalry(own.case, fit.case) > OVERTHROWS]
    return answer(claim.against(others, config, own.case), method, config)


def rigid_claim(a: PreparedMap, b: PreparedMap, fits: list[Fit], config: AlignmentConfig) -> Claim:
    """Return what the best of the fits shows with the maps laid as they are."""
    (own, T_a_b, candidate), *others = fits
    found = examine(a, b, T_a_b, config.tolerance_m)
    margin = margin_over(slid(a, b, found, config.tolerance_m), own)
    evidence = replace(found.evidence, score_m=own.worth(), margin=margin, proposal=candidate.evidence)
    return Claim(found, own, evidence, [], []).against([(case, T) for case, T, _ in others], config)


def bent_claim(a: PreparedMap, b: PreparedMap, fits: list[BentFit], config: AlignmentConfig) -> Claim:
    """Return what the best of the fits shows with map b bent; its transform is the rigid part."""
    best, *others = fits
    as_bent = best.bend.bent(b)
    found = examine(a, as_bent, best.bend.T_a_b, config.tolerance_m)
    rivals = [(fit.case, fit.bend.T_a_b) for fit in others]
    cases = slid(a, as_bent, found, config.tolerance_m) + [case for case, _ in rivals]
    evidence = replace(
        found.evidence,
        score_m=best.case.worth(),
        margin=margin_over(cases, best.case),
        bent_m=best.bend.residual_m,
        strain=best.bend.strain,
    )
    asked = bent_bounds(evidence.residual, min(a.wall_m, b.wall_m), config)
    return Claim(found, best.case, evidence, tests(evidence, config, asked), rivals)


def answer(claim: Claim, method: str, config: AlignmentConfig) -> Alignment | Rejection:
    """Return a claim as an alignment where it passed, else as a rejection with what it lacks."""
    evidence, T_a_b = claim.evidence, claim.found.T_a_b
    confidence = confidence_of(claim.judged)
    if claim.passed and confidence >= config.min_confidence:
        C = covariance(claim.found.H, claim.found.pivot, T_a_b, 0.5 * config.tolerance_m)
        return Alignment(T_a_b, confidence, evidence, C + _of_bend(evidence, claim.found), method)
    may_bend = all(test.slack >= 0 for test in claim.judged if not test.bends)
    why = complaint(claim.judged, confidence, evidence, config)
    return Rejection(why, confidence, evidence, method, T_a_b, may_bend, _places(claim))


def _of_bend(evidence: Evidence, found: Agreement) -> np.ndarray:
    """Return the ``(3, 3)`` covariance that a rigid transform has of maps that are bent: what it leaves over.

    The maps are turned about the middle of the walls that agree, not about b's origin.
    """
    turn = evidence.bent_m / max(evidence.extent_m, 1.0)
    return carried(np.diag([evidence.bent_m**2, evidence.bent_m**2, turn**2]), found.pivot, found.T_a_b)


def _places(claim: Claim) -> tuple[Transform, ...]:
    """Return the rivals too near to decide, nearest first, where the claim lacks nothing but a lead."""
    if not claim.lacks_lead:
        return ()
    lead = next(test for test in claim.judged if test.is_lead)
    near = sorted(((rivalry(claim.own, case), k) for k, (case, _) in enumerate(claim.rivals)), reverse=True)
    return tuple(claim.rivals[k][1] for share, k in near[:MOST_RIVALS] if 1.0 - share < lead.bound)


def confidence_of(judged: list[Test]) -> float:
    """Return 0..1: the logistic function of the weakest test's slack; 0.5 is where it just passes."""
    return 1.0 / (1.0 + math.exp(-max(-30.0, min(test.slack for test in judged))))


def complaint(judged: list[Test], confidence: float, evidence: Evidence, config: AlignmentConfig) -> str:
    """Return why a fit is rejected, in words with numbers."""
    failed = list(dict.fromkeys(test.complaint for test in judged if test.slack < 0))
    if not failed:
        failed.append(f"confidence {confidence:.3f}, at least {config.min_confidence:g} is asked for")
    if "matches" in evidence.proposal:
        failed.append(
            f"{evidence.proposal['inliers']:.0f} of {evidence.proposal['matches']:.0f} matched features agree"
        )
    failed.append(f"the best guess overlaps {evidence.overlap:.0%} of the smaller map")
    return "; ".join(failed)
