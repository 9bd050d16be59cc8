"""From candidates to an answer: refine, examine, compare with the next best distinct fit, accept or say why not."""

from __future__ import annotations

import math

import numpy as np

from alignment.config import AlignmentConfig
from alignment.prepared import PreparedMap
from alignment.refine import covariance, refine
from alignment.result import Alignment, Candidate, Rejection
from alignment.verify import Agreement, examine
from spatial import se2

SAME_M, SAME_RAD = 0.4, math.radians(4.0)
"""Two fits nearer than this, at the middle of b's walls, are one fit."""


def fit_score(evidence: dict[str, float]) -> float:
    """Return metres of wall that speak for a fit less what speaks against it (each metre of contradiction undoes three)."""
    good = min(evidence["matched_a_m"], evidence["matched_b_m"])
    bad = max(
        evidence["contradicted_a_m"] + 0.5 * evidence["opposed_a_m"],
        evidence["contradicted_b_m"] + 0.5 * evidence["opposed_b_m"],
    )
    return good - 3.0 * bad


def fitted(
    a: PreparedMap, b: PreparedMap, candidates: list[Candidate], config: AlignmentConfig
) -> list[tuple[Agreement, Candidate]]:
    """Return the distinct fits the candidates lead to, best first."""
    fits: list[tuple[float, Agreement, Candidate]] = []
    for candidate in candidates[: config.max_candidates]:
        pivot = 0.5 * (a.centre + se2.apply(candidate.T_a_b, b.centre))
        T_a_b = refine(a, b, candidate.T_a_b, pivot)
        if any(same(b, T_a_b, other.T_a_b) for _, other, _ in fits):
            continue
        found = examine(a, b, T_a_b, config.tolerance_m)
        fits.append((fit_score(found.evidence), found, candidate))
    fits.sort(key=lambda fit: -fit[0])
    return [(found, candidate) for _, found, candidate in fits]


def same(b: PreparedMap, T_1: se2.Transform, T_2: se2.Transform) -> bool:
    """Whether two transforms lay b at one place."""
    apart = np.hypot(*(se2.apply(T_1, b.centre) - se2.apply(T_2, b.centre)))
    return bool(apart < SAME_M and abs(float(se2.wrap(T_1[2] - T_2[2]))) < SAME_RAD)


def decide(
    a: PreparedMap, b: PreparedMap, candidates: list[Candidate], method: str, config: AlignmentConfig
) -> Alignment | Rejection:
    """Return the best candidate as an alignment where it passes every test, else a rejection that names those it fails."""
    if not candidates:
        return Rejection("no proposal: the maps share no matching structure", 0.0, {}, method)
    fits = fitted(a, b, candidates, config)
    best, candidate = fits[0]
    score = fit_score(best.evidence)
    second = max(fit_score(fits[1][0].evidence), 0.0) if len(fits) > 1 else 0.0
    evidence = {**candidate.evidence, **best.evidence, "score_m": score}
    evidence["margin"] = max(0.0, 1.0 - second / score) if score > 0 else 0.0
    faults = complaints(evidence, config)
    confidence = confidence_of(evidence, config)
    if faults:
        return Rejection("; ".join(faults), min(confidence, 0.99 * config.min_confidence), evidence, method, best.T_a_b)
    C = covariance(best.H, best.pivot, best.T_a_b, 0.5 * config.tolerance_m)
    return Alignment(best.T_a_b, max(confidence, config.min_confidence), evidence, C, method)


def confidence_of(evidence: dict[str, float], config: AlignmentConfig) -> float:
    """Return 0..1, 0.5 at the thresholds."""
    wall = min(evidence["matched_a_m"], evidence["matched_b_m"]) / max(config.min_matched_wall_m, 1e-9)
    agreement = min(evidence["wall_agreement_a"], evidence["wall_agreement_b"])
    logit = math.log(max(wall, 1e-3)) + 12.0 * (agreement - config.min_wall_agreement)
    return 1.0 / (1.0 + math.exp(-logit))


def complaints(evidence: dict[str, float], config: AlignmentConfig) -> list[str]:
    """Return what is missing for acceptance, in words with numbers."""
    faults = []
    wall = min(evidence["matched_a_m"], evidence["matched_b_m"])
    if wall < config.min_matched_wall_m:
        faults.append(f"matched wall {wall:.1f} m < {config.min_matched_wall_m:g} m")
    agreement = min(evidence["wall_agreement_a"], evidence["wall_agreement_b"])
    if agreement < config.min_wall_agreement:
        faults.append(f"walls agree to {100 * agreement:.0f} % < {100 * config.min_wall_agreement:.0f} %")
    if evidence["crosswise_m"] < config.min_crosswise_wall_m:
        faults.append(
            f"slides along its walls: {evidence['crosswise_m']:.1f} m across < {config.min_crosswise_wall_m:g} m"
        )
    if evidence["margin"] < config.min_margin:
        faults.append(
            f"ambiguous: leads the next fit by {100 * evidence['margin']:.0f} % < {100 * config.min_margin:.0f} %"
        )
    if faults and "matches" in evidence:
        faults.insert(0, f"{evidence['matches']:.0f} matches, {evidence['inliers']:.0f} inliers")
    if faults:
        faults.append(f"overlap {100 * evidence['overlap']:.0f} % ({evidence['overlap_m2']:.0f} m2)")
    return faults
