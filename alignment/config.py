"""Every knob of the alignment, with its unit, range and effect."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require


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
    """How far apart two walls may lie and still be one, metres (> 0)."""
    min_score_m: float = 5.0
    """Wall that agrees, discounted by what contradicts, metres (>= 0); higher asks for more common wall."""
    min_walls: int = 3
    """Distinct straight walls that must agree (>= 0), from one side or the other; any corner fits any other corner."""
    max_contradiction: float = 0.25
    """Wall that the other map shows free, as a share of the agreeing wall (>= 0); higher forgives more bending."""
    max_deep_contradiction: float = 0.1
    """The same, counting only wall far from any wall of the other map (>= 0); not explained by bending."""
    forgiveness: float = 0.05
    """Further share of either (>= 0) forgiven as agreeing wall grows from 15 m to 75 m on ten walls or more."""
    min_crosswise_wall_m: float = 0.4
    """Agreeing wall across the weakest direction, metres (>= 0); stops a corridor that slides along itself."""
    min_crosswise: float = 0.02
    """The same as a share (0..1) of the agreeing wall."""
    min_margin: float = 0.58
    """Lead (0..1) in score over the best distinct other fit; below it the answer is "ambiguous"."""
    margin_per_contradiction: float = 0.7
    """Further lead asked for per share of contradicted wall (>= 0): a fit that is not clean must stand alone."""
    min_confidence: float = 0.5
    """Confidence (0..1) from which a fit that passes every test is accepted; 0.5 is where a test just passes."""
    orb_features: int = 2000
    """Most ORB or SURF key points kept per map (>= 10)."""
    ransac_draws: int = 4000
    """Random pairs of matches tried (>= 1)."""
    ransac_inlier_m: float = 0.2
    """Distance up to which a match supports a transform, metres (> 0)."""
    evaluations: int = 2000
    """Dissimilarities each search of the random-walk family may compute (>= 1)."""
    max_candidates: int = 10
    """Proposals that are refined and verified in full (>= 1); more find more and take longer."""

    def __post_init__(self) -> None:
        require(self.seed >= 0, "alignment.seed", ">= 0", self.seed)
        for name in ("resolution_m", "tolerance_m", "ransac_inlier_m"):
            require(getattr(self, name) > 0, f"alignment.{name}", "> 0 m", getattr(self, name))
        for name in (
            "min_score_m",
            "min_walls",
            "max_contradiction",
            "max_deep_contradiction",
            "forgiveness",
            "min_crosswise_wall_m",
            "margin_per_contradiction",
        ):
            require(getattr(self, name) >= 0, f"alignment.{name}", ">= 0", getattr(self, name))
        for name in ("min_crosswise", "min_margin", "min_confidence"):
            require(0 <= getattr(self, name) <= 1, f"alignment.{name}", "in 0..1", getattr(self, name))
        for name, least in (("max_cells", 10_000), ("orb_features", 10), ("ransac_draws", 1)):
            require(getattr(self, name) >= least, f"alignment.{name}", f">= {least}", getattr(self, name))
        for name in ("evaluations", "max_candidates"):
            require(getattr(self, name) >= 1, f"alignment.{name}", ">= 1", getattr(self, name))
