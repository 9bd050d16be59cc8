"""The places of a search once more, each with the map bent to fit there."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels.agreement import free_overlap
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.verification.bend import Bend
from mrslam.alignment.verification.bending import COARSE, FINE, bend, judge_bent, straight
from mrslam.alignment.verification.verify import QUICK_CELLS, Case, free_step
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

SAME_M, SAME_RAD = 1.0, math.radians(8.0)
"""Two bent fits nearer than this, at the middle of b's walls, are one place: it is bent towards from several sides."""

PROMISING = 0.15
"""Share of the best place's worth, all bent coarsely, below which a place is not bent further; the right place of two
hundred was never below half of the best."""


@dataclass(frozen=True, eq=False)
class BentFit:
    """One place with what speaks for and against it once b is bent to fit there."""

    case: Case
    bend: Bend
    start: int
    """Index of the place it was bent from."""


def bent_fits(a: PreparedMap, b: PreparedMap, places: list[Transform], config: AlignmentConfig) -> list[BentFit]:
    """Return the distinct places with b bent to fit at each, best first; those far behind are left out."""
    begun = []
    for k, T_a_b in enumerate(places):
        by = bend(a, b, straight(b, T_a_b), config.strain, COARSE)
        begun.append(BentFit(_case(a, b, by, config.tolerance_m), by, k))
    least = PROMISING * max((fit.case.worth() for fit in begun), default=0.0)
    found = []
    for fit in begun:
        if fit.case.worth() >= least:
            by = bend(a, b, fit.bend, config.strain, FINE)
            found.append(BentFit(_case(a, b, by, config.tolerance_m), by, fit.start))
    found.sort(key=lambda fit: -fit.case.worth())
    kept: list[BentFit] = []
    for fit in found:
        if not any(is_one_place(b, fit.bend.T_a_b, other.bend.T_a_b) for other in kept):
            kept.append(fit)
    return kept


def is_one_place(b: PreparedMap, T_1: Transform, T_2: Transform) -> bool:
    """Return whether two transforms are estimates of one place of a map that is bent."""
    apart = se2.apply(T_1, b.centre) - se2.apply(T_2, b.centre)
    return bool(np.hypot(*apart) < SAME_M and abs(se2.wrap(T_1[2] - T_2[2])) < SAME_RAD)


def _case(a: PreparedMap, b: PreparedMap, by: Bend, tolerance_m: float) -> Case:
    """Return what speaks for and against a place under a bend, from samples."""
    on_a, on_b = judge_bent(a, b, by, tolerance_m)
    small, large, T = (a, b, se2.inverse(by.T_a_b)) if a.state.size <= b.state.size else (b, a, by.T_a_b)
    step = free_step(small, QUICK_CELLS)
    free, _, _, _ = free_overlap(small.state, small.x0, small.y0, step, T, large.state, large.x0, large.y0, a.res)
    return Case(
        matched_m=float(min(on_a[0], on_b[0])),
        opposed_m=float(min(on_a[1], on_b[1])),
        contradicted_m=float(max(on_a[2], on_b[2])),
        free_m2=free * (step * a.res) ** 2,
    )
