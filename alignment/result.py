"""What an alignment returns: a transform with its evidence, or a refusal in words with numbers."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.evidence import Evidence
from mrslam.spatial.errors import InputError
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, eq=False)
class Alignment:
    """Two maps fit together."""

    T_a_b: Transform
    """``(3,) float64``: maps points of map b to map a, metres and radians."""
    confidence: float
    """0..1; accepted from ``AlignmentConfig.min_confidence`` on."""
    evidence: Evidence
    """What the decision rests on."""
    covariance: NDArray[np.float64]
    """``(3, 3)`` of ``T_a_b`` (m, m, rad), from the curvature of the fit."""
    method: str
    """Name of the aligner that proposed it."""
    is_in_parts: bool = False
    """Whether parts of large maps fit there one by one, and the wholes once their scans have bent them."""

    @property
    def accepted(self) -> bool:
        """True: here is a transform."""
        return True


@dataclass(frozen=True, eq=False)
class Rejection:
    """Two maps do not fit together, or not provably."""

    reason: str
    """Why, in words with numbers."""
    confidence: float
    """0..1, of the best proposal."""
    evidence: Evidence | None
    """What the decision rests on; None where no proposal was examined."""
    method: str
    """Name of the aligner that was asked."""
    T_a_b: Transform | None = None
    """Best proposal, for diagnosis only; never to be used as a transform."""
    may_bend: bool = False
    """Whether its only faults are those of bent maps of one place: walls where the other is free, and rivals for it."""
    rivals: tuple[Transform, ...] = ()
    """Where else b fits about as well as at ``T_a_b``, best first; only where nothing but them forbids acceptance."""
    is_in_parts: bool = False
    """Whether ``T_a_b`` is where parts of a large map fit one by one, of which the whole is bent too much."""

    @property
    def ambiguous(self) -> bool:
        """Whether b fits at several places, ``T_a_b`` and ``rivals``, and nothing in the maps says at which."""
        return bool(self.rivals)

    @property
    def accepted(self) -> bool:
        """False: there is no transform."""
        return False


@dataclass(frozen=True, eq=False)
class Prior:
    """What is known of the transform beforehand; narrows the search."""

    T_a_b: Transform
    """``(3,)`` expected transform."""
    covariance: NDArray[np.float64]
    """``(3, 3)``, m, m, rad."""
    of_inverse: bool = False
    """Whether both are of ``T_b_a``: a place in b without a heading is none of b's origin in a."""

    def __post_init__(self) -> None:
        T_a_b, covariance = np.array(self.T_a_b, dtype=np.float64), np.array(self.covariance, dtype=np.float64)
        if T_a_b.shape != (3,) or not np.isfinite(T_a_b).all():
            raise InputError(f"a prior's T_a_b must be three finite numbers, got {self.T_a_b!r}")
        if covariance.shape != (3, 3) or not np.isfinite(covariance).all():
            raise InputError(f"a prior's covariance must be 3 x 3 finite numbers, got shape {covariance.shape}")
        if not np.allclose(covariance, covariance.T) or np.linalg.eigvalsh(covariance)[0] < -1e-12:
            raise InputError("a prior's covariance must be symmetric and not negative")
        object.__setattr__(self, "T_a_b", T_a_b)
        object.__setattr__(self, "covariance", covariance)


@dataclass(frozen=True, eq=False)
class Candidate:
    """One proposal of an aligner, before refinement and verification."""

    T_a_b: Transform
    """``(3,)``."""
    score: float = 0.0
    """The proposer's own measure; higher is better, comparable within one aligner only."""
    evidence: dict[str, float] = field(default_factory=dict)
    """The proposer's own numbers (matches, inliers, ...)."""
