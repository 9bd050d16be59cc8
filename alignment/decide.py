"""From candidates to an answer: refine, examine, compare with the next best distinct fit, accept or say why not."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from alignment.config import AlignmentConfig
from alignment.prepared import PreparedMap
from alignment.refine import covariance, refine
from alignment.result import Alignment, Candidate, Rejection
from alignment.verify import Agreement, examine
from spatial import se2

SAME_M, SAME_RAD = 0.4, math.radians(4.0)
"""Two fits nearer than this, at the middle of b's walls, are one fit."""


HELD = 0.15
"""Share of the matched wall that runs across, from which a fit is held in every direction."""
MOST_MARGIN = 0.95
"""No greater lead is asked for."""


@dataclass(frozen=True)
class Test:
    """One thing a fit must show."""

    value: float
    bound: float
    scale: float
    """Change of ``value`` that matters; negative where less is better."""
    words: str
    """Complaint, with ``{value}`` and ``{bound}``."""

    @property
    def slack(self) -> float:
        """Return by how much it is passed, in ``scale``; negative where failed."""
        return (self.value - self.bound) / self.scale


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
    matched = max(min(evidence["matched_a_m"], evidence["matched_b_m"]), 1e-3)
    return max(score_m, 0.0) * min(1.0, evidence["crosswise_m"] / matched / HELD)


def tests(evidence: dict[str, float], config: AlignmentConfig) -> list[Test]:
    """Return all that a fit must show to be accepted."""
    matched = max(min(evidence["matched_a_m"], evidence["matched_b_m"]), 1e-3)
    against = max(evidence["contradicted_a_m"], evidence["contradicted_b_m"]) / matched
    deep = max(evidence["deep_a_m"], evidence["deep_b_m"]) / matched
    across = evidence["crosswise_m"]
    stained = max(0.0, against + 0.5 * deep - 0.03)
    lead = min(MOST_MARGIN, config.min_margin + config.margin_per_contradiction * stained)
    percent: Callable[[str], str] = lambda name: f"{name} {{value:.0%}} of the matched wall > {{bound:.0%}}"  # noqa: E731
    return [
        Test(evidence["score_m"], config.min_score_m, 2.0, "wall for less against {value:.1f} m < {bound:.1f} m"),
        Test(evidence["walls"], config.min_walls, 2.0, "rests on {value:.0f} distinct walls < {bound:.0f}"),
        Test(against, config.max_contradiction, -0.1, percent("contradicted")),
        Test(deep, config.max_deep_contradiction, -0.05, percent("clearly contradicted")),
        Test(across, config.min_crosswise_wall_m, 0.5, "slides along its walls: {value:.1f} m across < {bound:.1f} m"),
        Test(across / matched, config.min_crosswise, 0.05, "slides along its walls: {value:.0%} across < {bound:.0%}"),
        Test(evidence["margin"], lead, 0.2, "ambiguous: leads the next fit by {value:.0%} < {bound:.0%}"),
    ]


def same(b: PreparedMap, T_1: se2.Transform, T_2: se2.Transform) -> bool:
    """Whether two transforms lay b at one place."""
    if abs(math.remainder(T_1[2] - T_2[2], 2.0 * math.pi)) >= SAME_RAD:
        return False
    apart = se2.apply(T_1, b.centre) - se2.apply(T_2, b.centre)
    return math.hypot(apart[0], apart[1]) < SAME_M


def fits_of(
    a: PreparedMap, b: PreparedMap, candidates: list[Candidate], config: AlignmentConfig
) -> list[tuple[float, Agreement, Candidate]]:
    """Return the distinct fits the candidates lead to with their scores, best first."""
    fits: list[tuple[float, Agreement, Candidate]] = []
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
    a: PreparedMap, b: PreparedMap, candidates: list[Candidate], method: str, config: AlignmentConfig
) -> Alignment | Rejection:
    """Return the best candidate as an alignment where it passes every test, else a rejection that says why."""
    if not candidates:
        return Rejection("no proposal: the maps share no matching structure", 0.0, {}, method)
    fits = fits_of(a, b, candidates, config)
    score, best, candidate = fits[0]
    own = standing(score, best.evidence)
    second = max((standing(other, found.evidence) for other, found, _ in fits[1:]), default=0.0)
    evidence = {**candidate.evidence, **best.evidence, "score_m": score}
    evidence["margin"] = max(0.0, 1.0 - second / own) if own > 0 else 0.0
    asked = tests(evidence, config)
    confidence = 1.0 / (1.0 + math.exp(-max(-30.0, min(t.slack for t in asked))))
    failed = [t.words.format(value=t.value, bound=t.bound) for t in asked if t.slack < 0]
    if not failed and confidence >= config.min_confidence:
        C = covariance(best.H, best.pivot, best.T_a_b, 0.5 * config.tolerance_m)
        return Alignment(best.T_a_b, confidence, evidence, C, method)
    if not failed:
        failed.append(f"confidence {confidence:.2f} < {config.min_confidence:g}")
    if "matches" in evidence:
        failed.insert(0, f"{evidence['matches']:.0f} matches, {evidence['inliers']:.0f} inliers")
    failed.append(f"overlap {evidence['overlap']:.0%} ({evidence['overlap_m2']:.0f} m2)")
    return Rejection("; ".join(failed), confidence, evidence, method, best.T_a_b)
