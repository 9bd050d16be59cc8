"""Every knob of the alignment, with its unit, range and effect."""

from __future__ import annotations

from dataclasses import dataclass

from spatial.errors import require


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
    min_matched_wall_m: float = 8.0
    """Wall, metres (>= 0), that must lie on wall of the other map in both directions."""
    min_wall_agreement: float = 0.7
    """Share (0..1) of the walls seen by both maps on which they must agree, in each direction."""
    min_crosswise_wall_m: float = 1.5
    """Matched wall across the weakest direction, metres (>= 0); stops a corridor that slides along itself."""
    min_margin: float = 0.1
    """Lead (0..1) in score over the best distinct other fit; below it the answer is "ambiguous"."""
    min_confidence: float = 0.5
    """Confidence (0..1) from which a fit is accepted; higher accepts fewer."""
    orb_features: int = 2000
    """Most ORB or SURF key points kept per map (>= 10)."""
    ransac_draws: int = 4000
    """Random pairs of matches tried (>= 1)."""
    ransac_inlier_m: float = 0.2
    """Distance up to which a match supports a transform, metres (> 0)."""
    evaluations: int = 2000
    """Dissimilarities each search of the random-walk family may compute (>= 1)."""
    max_candidates: int = 24
    """Proposals that are refined and verified in full (>= 1); more find more and take longer."""

    def __post_init__(self) -> None:
        require(self.seed >= 0, "alignment.seed", ">= 0", self.seed)
        for name in ("resolution_m", "tolerance_m", "ransac_inlier_m"):
            require(getattr(self, name) > 0, f"alignment.{name}", "> 0 m", getattr(self, name))
        for name in ("min_matched_wall_m", "min_crosswise_wall_m"):
            require(getattr(self, name) >= 0, f"alignment.{name}", ">= 0 m", getattr(self, name))
        for name in ("min_wall_agreement", "min_margin", "min_confidence"):
            require(0 <= getattr(self, name) <= 1, f"alignment.{name}", "in 0..1", getattr(self, name))
        for name, least in (("max_cells", 10_000), ("orb_features", 10), ("ransac_draws", 1)):
            require(getattr(self, name) >= least, f"alignment.{name}", f">= {least}", getattr(self, name))
        for name in ("evaluations", "max_candidates"):
            require(getattr(self, name) >= 1, f"alignment.{name}", ">= 1", getattr(self, name))
