"""The distinct places a search found, refined, and how near each comes to the best one."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.result import Candidate
from mrslam.alignment.verification.refine import refine
from mrslam.alignment.verification.verify import DISCOUNT, Agreement, Case, quick_case
from mrslam.spatial import se2

Fit = tuple[Case, se2.Transform, Candidate]
"""A refined candidate: what speaks for and against it, where b lies, where it came from."""
SAME_M, SAME_RAD = 0.4, math.radians(4.0)
"""Two fits nearer than this, at the middle of b's walls, are one fit."""
LEAST_DISCOUNT = 0.1
"""Contradicted wall per metre of agreeing wall that makes a rival e times less worth where the best fit has none;
bounds how severely rivals are judged: 0.4 of ``DISCOUNT``, which applies where the best fit contradicts by 0.083."""
LEAST_KEPT = 0.78
"""Share of its usual worth that a rival keeps however severely it is judged; bounds what a clean best fit gains."""
THINNED = 2000
"""Wall points per map that refine a candidate: 0.15 m and less from one to the next in maps of 300 m of wall."""
FINE = ((0.3, 0.1, 8),)
"""How the best of them is refined on all points: reach and kernel scale, metres, and rounds."""
FREE_CELLS = 100_000
"""Cells of free space looked at, over which what is free in both maps shows to a few per mille."""
SLIDES_M = (-3.0, -1.5, -0.75, 0.75, 1.5, 3.0)
"""How far the best fit is slid along its walls to see whether it fits there as well, metres."""


def rivalry(best: Case, rival: Case) -> float:
    """Return how near a distinct other fit comes to the best one, 0..1 and more.

    Maps that hardly contradict each other at one place would not do so at their true place either: the cleaner the best
    fit, the more a rival's contradictions count, but never so much that it loses more than a share of its worth. And a
    rival is no nearer to the best than the balance of what speaks for and against it.
    """
    discount = min(max(3.0 * best.contradicted_m / max(best.matched_m, 0.1), LEAST_DISCOUNT), DISCOUNT)
    near = max(
        rival.worth(discount) / max(best.worth(discount), 1e-3), LEAST_KEPT * rival.worth() / max(best.worth(), 1e-3)
    )
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
    """Return the distinct fits the candidates lead to with their scores, best first; the best is refined on all walls.

    Which place is the best shows on ``THINNED`` points of each map, and to a millimetre or two where it lies.
    """
    fits: list[Fit] = []
    for candidate in candidates:
        if len(fits) == config.max_candidates:
            break
        if any(same(b, candidate.T_a_b, T) for _, T, _ in fits):
            continue
        T_a_b = refine(a, b, candidate.T_a_b, most_points=THINNED)
        if any(same(b, T_a_b, T) for _, T, _ in fits):
            continue
        fits.append((_case(a, b, T_a_b, config.tolerance_m), T_a_b, candidate))
    fits.sort(key=lambda fit: -fit[0].worth())
    if fits and max(len(a.points), len(b.points)) > THINNED:
        _, T_a_b, candidate = fits[0]
        T_a_b = refine(a, b, T_a_b, FINE)
        fits[0] = _case(a, b, T_a_b, config.tolerance_m), T_a_b, candidate
    return fits


def _case(a: PreparedMap, b: PreparedMap, T_a_b: se2.Transform, tolerance_m: float) -> Case:
    return quick_case(a, b, T_a_b, tolerance_m, most_cells=FREE_CELLS)


def margin_over(rivals: list[Case], best: Case) -> float:
    """Return 0..1: the best fit's lead over the nearest of its rivals."""
    return max(0.0, 1.0 - max((rivalry(best, rival) for rival in rivals), default=0.0))
