"""Settings of merging."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require, require_bounds

FUSIONS = ("log-odds", "max", "mean")
"""Ways to fuse known with known."""
COMPONENTS = ("count", "area")
"""What makes one component of the team graph the largest."""


BOUNDS = {
    "resolution_m": (0.001, 10.0), "min_confidence": (0.0, 1e3), "loop_tolerance_m": (1e-4, 1e4),
    "loop_tolerance_rad": (1e-5, 10.0), "loop_tolerance_share": (0.0, 0.99), "covariance_scale": (1e-4, 1e6),
    "robust_sigmas": (0.01, 1e3), "known_pose_sigma_m": (1e-4, 1e4), "known_pose_sigma_rad": (1e-5, 10.0),
    "contradiction_share": (0.001, 1.0), "contradiction_min_m": (0.001, 1e6),
    "contradiction_tolerance_m": (1e-4, 100.0),
}  # fmt: skip
"""Least and largest value of every number."""


@dataclass(frozen=True, kw_only=True)
class MergeConfig:
    """How maps are placed and fused; every value is checked where it is made."""

    fusion: str = "log-odds"
    """Known with known: "log-odds" (evidence adds up), "max" (a wall seen once stays) or "mean"."""
    component: str = "count"
    """Without an anchor the component placed is the one of most robots ("count"), or of most known "area"."""
    resolution_m: float | None = None
    """Cell edge of the team map, metres, > 0; None takes the finest of the maps placed."""
    min_confidence: float = 0.0
    """Expert: edges of lower confidence are not used, >= 0; alignment decides already, so 0 uses all it accepted."""
    loop_tolerance_m: float = 0.5
    """Expert: a loop of three alignments may fail to close by this much at the middle of a map, metres, > 0."""
    loop_tolerance_rad: float = 0.06
    """Expert: a loop of three alignments may fail to close by this angle, radians, > 0."""
    loop_tolerance_share: float = 0.015
    """Expert: loops may also fail by this share of the map's diameter, >= 0: maps of long runs are bent."""
    covariance_scale: float = 4.0
    """Expert: alignments' covariances are multiplied by this in the joint solution, > 0: Hessians promise too much."""
    robust_sigmas: float = 3.0
    """Expert: residuals beyond this many standard deviations lose weight in the joint solution (Cauchy), > 0."""
    known_pose_sigma_m: float = 0.10
    """Standard deviation of given starting positions, metres, > 0; alignments correct them within it."""
    known_pose_sigma_rad: float = 0.03
    """Standard deviation of given starting headings, radians, > 0."""
    contradiction_share: float = 0.3
    """Expert: two placed maps contradict where more of the walls that both must see is on free space, share 0..1."""
    contradiction_min_m: float = 8.0
    """Expert: ... and at least this length of wall does so, metres, > 0."""
    contradiction_tolerance_m: float = 0.3
    """Expert: walls nearer than this agree, metres, > 0: noise, and maps that are bent."""

    def __post_init__(self) -> None:
        require(self.fusion in FUSIONS, "merge.fusion", f"one of {', '.join(FUSIONS)}", self.fusion)
        require(self.component in COMPONENTS, "merge.component", f"one of {', '.join(COMPONENTS)}", self.component)
        require_bounds("merge", self, BOUNDS)
