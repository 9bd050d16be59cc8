"""An accepted alignment between two robots' maps, as the team graph keeps it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.spatial import InputError, se2

Pair = tuple[str, str]
"""Two robot ids, the smaller one first."""


class AlignmentLike(Protocol):
    """What merging reads of an ``mrslam.alignment.Alignment``."""

    @property
    def T_a_b(self) -> NDArray[np.float64]: ...  # noqa: D102
    @property
    def confidence(self) -> float: ...  # noqa: D102
    @property
    def covariance(self) -> NDArray[np.float64]: ...  # noqa: D102


@dataclass(frozen=True, kw_only=True, eq=False)
class Edge:
    """``T_a_b`` between two maps; ``a < b``."""

    a: str
    b: str
    T_a_b: se2.Transform
    """``(3,)``: maps points of b's map into a's map."""
    confidence: float
    """Of the alignment; the larger the better."""
    covariance: NDArray[np.float64]
    """``(3, 3)`` of ``T_a_b``'s parameters: metres, metres, radians."""

    @property
    def pair(self) -> Pair:
        """The ids."""
        return self.a, self.b

    @property
    def content(self) -> tuple[Pair, bytes, bytes, float]:
        """All of it, for telling whether anything has changed."""
        return self.pair, self.T_a_b.tobytes(), self.covariance.tobytes(), self.confidence

    def from_to(self, a: str) -> se2.Transform:
        """Return the transform that maps points of the other robot's map into ``a``'s."""
        return self.T_a_b if a == self.a else se2.inverse(self.T_a_b)

    def other(self, robot_id: str) -> str:
        """Return the robot at the other end."""
        return self.b if robot_id == self.a else self.a


def pair_of(a: str, b: str) -> Pair:
    """Return the ids in order; raise ``InputError`` where they are one robot."""
    if a == b:
        raise InputError(f"an alignment needs two robots, got {a!r} twice")
    return (a, b) if a < b else (b, a)


def seen_from(pair: Pair, first: str, T: se2.Transform) -> se2.Transform:
    """Return a pair's ``T_a_b (3,)`` as the transform from map ``first`` to the other, or that one as ``T_a_b``."""
    return T if first == pair[0] else se2.inverse(T)


def make_edge(a: str, b: str, alignment: AlignmentLike) -> Edge:
    """Return the edge of an alignment ``T_a_b``, turned around where ``b < a``."""
    first, second = pair_of(a, b)
    T_a_b = np.array(alignment.T_a_b, dtype=np.float64)
    covariance = np.array(alignment.covariance, dtype=np.float64)
    if T_a_b.shape != (3,) or not np.isfinite(T_a_b).all():
        raise InputError(f"alignment of {a} and {b}: T_a_b must be three finite numbers, got {alignment.T_a_b!r}")
    if covariance.shape != (3, 3) or not np.isfinite(covariance).all():
        raise InputError(f"alignment of {a} and {b}: the covariance must be a finite 3 x 3 matrix")
    if (first, second) != (a, b):
        T_a_b, covariance = se2.inverse(T_a_b), inverse_covariance(T_a_b, covariance)
    return Edge(
        a=first,
        b=second,
        T_a_b=T_a_b,
        confidence=float(alignment.confidence),
        covariance=covariance,
    )


def inverse_covariance(T_a_b: ArrayLike, covariance: ArrayLike) -> NDArray[np.float64]:
    """Return the covariance of ``T_b_a`` given that of ``T_a_b``, to first order."""
    x, y, theta = np.asarray(T_a_b, dtype=np.float64)
    cos, sin = np.cos(theta), np.sin(theta)
    jacobian = np.array(
        [[-cos, -sin, sin * x - cos * y], [sin, -cos, cos * x + sin * y], [0.0, 0.0, -1.0]],
    )
    return jacobian @ np.asarray(covariance, dtype=np.float64) @ jacobian.T
