"""Every knob of the alignment, with its unit, range and effect."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import SEEDS, require_bounds

BOUNDS = {
    "seed": SEEDS, "resolution_m": (0.001, 10.0), "max_cells": (10_000, 1 << 28), "tolerance_m": (0.001, 100.0),
    "min_score_m": (0.0, 1e6), "min_walls": (0, 100_000), "max_contradiction": (0.0, 1e3),
    "max_deep_contradiction": (0.0, 1e3), "forgiveness": (0.0, 1e3), "min_crosswise_wall_m": (0.0, 1e6),
    "min_crosswise": (0.0, 1.0), "min_margin": (0.0, 1.0), "margin_per_contradiction": (0.0, 1e3),
    "min_confidence": (0.0, 1.0), "strain": (0.0, 0.2), "min_bent_score_m": (0.0, 1e6),
    "min_bent_share": (0.0, 1.0), "max_bent_contradiction": (0.0, 1e3),
    "orb_features": (10, 1_000_000), "ransac_draws": (1, 10_000_000), "ransac_inlier_m": (0.001, 100.0),
    "evaluations": (1, 10_000_000), "max_candidates": (1, 10_000),
}  # fmt: skip
"""Least and largest value of every setting."""


@dataclass(frozen=True, kw_only=True)
class AlignmentConfig:
    """How maps are searched for, refined and judged; raises ``InputError`` where a value makes no sense."""

    seed: int = 0
    """Seed of every random draw (>= 0); same maps and seed, same answer."""
    resolution_m: float = 0.05
    """Finest cell worked at, metres (> 0); finer maps are coarsened to it, coarser ones keep their own."""
    max_cells: int = 8_000_000
    """Cells per map above which the working cell is doubled (>= 10000); bounds memory and time."""
    tolerance_m: float = 0.15
    """Expert: how far apart two walls may lie and still be one, metres (> 0)."""
    min_score_m: float = 5.0
    """Wall that agrees, discounted by what contradicts, metres (>= 0); higher asks for more common wall."""
    min_walls: int = 3
    """Expert: distinct straight walls that must agree (>= 0), seen from either side; all corners are alike."""
    max_contradiction: float = 0.25
    """Expert: wall that the other map shows free per agreeing wall (>= 0); higher forgives more bending."""
    max_deep_contradiction: float = 0.1
    """Expert: like ``max_contradiction`` (>= 0), of wall far from any of the other map: bending does not explain it."""
    forgiveness: float = 0.05
    """Expert: further share (>= 0) of both, forgiven as agreeing wall grows from 15 m to 75 m on ten walls or more."""
    min_crosswise_wall_m: float = 0.4
    """Expert: agreeing wall across the weakest direction, metres (>= 0); stops a corridor that slides along itself."""
    min_crosswise: float = 0.02
    """Expert: like ``min_crosswise_wall_m``, as a share (0..1) of the agreeing wall."""
    min_margin: float = 0.58
    """Lead (0..1) in score over the best distinct other fit; below it the answer is "ambiguous"."""
    margin_per_contradiction: float = 0.7
    """Expert: further lead (>= 0) asked for per contradicted share: a fit that is not clean must stand alone."""
    min_confidence: float = 0.5
    """Confidence (0..1) from which a fit that passes every test is accepted; 0.5 is where a test just passes."""
    strain: float = 0.03
    """Usual deformation per metre of maps that do not fit rigidly (0..0.2): 0.03 is 3 % of scale; 0 bends none.
    A team's maps, and others with the scans that made them, are bent by these instead."""
    min_bent_score_m: float = 12.0
    """Expert: like ``min_score_m`` (>= 0), of maps that fit only bent: chance fits are bent to fit, too."""
    min_bent_share: float = 0.1
    """Expert: least such score per wall of the smaller map (0..1): chance agrees in proportion to the wall there is."""
    max_bent_contradiction: float = 0.45
    """Expert: like ``max_contradiction`` (>= 0), of maps that fit only bent: their walls are ragged, doors shut."""
    orb_features: int = 2000
    """Expert: most ORB or SURF key points kept per map (>= 10)."""
    ransac_draws: int = 4000
    """Expert: random pairs of matches tried (>= 1)."""
    ransac_inlier_m: float = 0.2
    """Expert: distance up to which a match supports a transform, metres (> 0)."""
    evaluations: int = 2000
    """Dissimilarities each search of the random-walk family may compute (>= 1)."""
    max_candidates: int = 10
    """Expert: proposals that are refined and verified in full (>= 1); more find more and take longer."""

    def __post_init__(self) -> None:
        require_bounds("alignment", self, BOUNDS)
