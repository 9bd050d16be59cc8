"""Pose graphs over SE(2): nodes are poses, edges say how one lies in the frame of another, and how surely."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import dijkstra

from mrslam.spatial import se2
from mrslam.spatial.normal_equations import Factors, NormalEquations
from mrslam.spatial.se2 import Transform

ITERATIONS = 4
"""Gauss-Newton steps at most: from a trajectory that is nearly right the third moves nothing by a millimetre."""
SETTLED_M = 1e-3
"""A step smaller than this, in metres and radians, ends the relaxation."""
ANNEALING = 2.0
"""Factor by which the graduated loss becomes sharper in each step (Yang et al.: 1.4; 2 takes fewer solves)."""
ANNEALING_STEPS = 20
"""Steps at most: from errors a million times the bound to a sharp loss."""

RECALL = 9.0
"""Edges that are not believed are tried again where they miss by no more than this multiple of the bound (three times
as far): a wrong edge may have pulled right ones that far. Measured: to 183 of a bound of 16, wrong ones to 1100."""
RECALLS = 6
"""Times at most that edges are tried again: each brings more of them within reach."""


class Edges(NamedTuple):
    """``second[e]`` is at ``T_first_second[e]`` in the frame of ``first[e]``, with ``information[e]``."""

    first: NDArray[np.int64]
    """``(E,)`` node indices."""
    second: NDArray[np.int64]
    """``(E,)`` node indices."""
    T_first_second: Transform
    """``(E, 3)`` metres, radians."""
    information: NDArray[np.float64]
    """``(E, 3, 3)``, inverse covariances of :meth:`residuals`, in the axes of ``first``: 1/m^2, 1/(m rad), 1/rad^2."""

    @classmethod
    def none(cls) -> Edges:
        """Return no edges."""
        return cls(np.empty(0, np.int64), np.empty(0, np.int64), np.empty((0, 3)), np.empty((0, 3, 3)))

    @classmethod
    def joined(cls, parts: Sequence[Edges]) -> Edges:
        """Return the edges of all parts, in their order."""
        return cls(*(np.concatenate(columns) for columns in zip(cls.none(), *parts, strict=True)))

    def part(self, chosen: NDArray[np.bool_]) -> Edges:
        """Return the edges that are ``chosen (E,)``, in their order."""
        return Edges(self.first[chosen], self.second[chosen], self.T_first_second[chosen], self.information[chosen])

    def shifted(self, nodes: int) -> Edges:
        """Return the same edges between nodes that stand ``nodes`` later in the graph."""
        return self._replace(first=self.first + nodes, second=self.second + nodes)

    def residuals(self, poses: Transform) -> Transform:
        """Return ``(E, 3)``: where ``second`` is in the frame of ``first``, minus where the edge says it is; m, rad."""
        error = se2.between(poses[self.first], poses[self.second]) - self.T_first_second
        error[:, 2] = se2.wrap(error[:, 2])
        return error

    def chi2(self, poses: Transform) -> NDArray[np.float64]:
        """Return ``(E,)``: squared Mahalanobis lengths of the residuals, 3 degrees of freedom each."""
        error = self.residuals(poses)
        return np.einsum("ei,eij,ej->e", error, self.information, error)


def shortest(lengths: NDArray[np.float64], ends: NDArray[np.int64], count: int, source: int) -> NDArray[np.float64]:
    """Return ``(count,)``: the length of the shortest way from one node to each, over edges of these ``lengths (E,)``.

    ``ends (E, 2)`` : the nodes that edges join, either way; lengths must be above 0.
    """
    graph = coo_matrix((lengths, (ends[:, 0], ends[:, 1])), shape=(count, count)).tocsr()
    return np.asarray(dijkstra(graph, directed=False, indices=np.array([source])))[0]


def relax(poses: Transform, edges: Edges, robust: NDArray[np.bool_], robust_scale: float = 3.0) -> Transform:
    """Return the poses ``(K, 3)`` that fit the edges best, the first staying where it is (Lu and Milios 1997, SE(2)).

    Edges marked ``robust (E,)`` lose weight when they miss by more than ``robust_scale`` sigmas (Cauchy), so that a
    wrong one cannot bend the rest.
    """
    poses = np.array(poses, dtype=np.float64)
    if poses.shape[0] < 2 or edges.first.size == 0:
        return poses
    equations = _equations(edges, poses)
    for _ in range(ITERATIONS):
        weight = np.where(robust, 1.0 / (1.0 + edges.chi2(poses) / robust_scale**2), 1.0)
        if _step(poses, edges, equations, weight) < SETTLED_M:
            break
    return poses


def relax_graduated(
    poses: Transform, edges: Edges, doubtful: NDArray[np.bool_], bound: float
) -> tuple[Transform, NDArray[np.float64]]:
    """Return the relaxed poses ``(K, 3)``, and weights ``(E,)``: 0 for the edges that are not believed.

    Graduated non-convexity with truncated least squares (Yang et al. 2020, equations 12-14): an edge marked
    ``doubtful (E,)`` whose squared Mahalanobis length exceeds ``bound`` (chi2, 3 degrees of freedom) in the end has
    weight 0. The others always have weight 1.
    """
    poses = np.array(poses, dtype=np.float64)
    weight = np.ones(edges.first.size)
    if poses.shape[0] < 2 or edges.first.size == 0:
        return poses, weight
    equations = _equations(edges, poses)
    _settle(poses, edges, equations, weight)
    if not doubtful.any():
        return poses, weight
    worst = float(edges.chi2(poses)[doubtful].max())
    if worst <= bound:
        return poses, weight
    _anneal(poses, edges, equations, doubtful, bound, worst)
    weight = np.where(doubtful & (edges.chi2(poses) > bound), 0.0, 1.0)
    _settle(poses, edges, equations, weight)
    return poses, weight


def relax_again(
    begin: Transform,
    poses: Transform,
    edges: Edges,
    doubtful: NDArray[np.bool_],
    weight: NDArray[np.float64],
    bound: float,
) -> tuple[Transform, NDArray[np.float64]]:
    """Return poses ``(K, 3)`` and weights ``(E,)`` as of :func:`relax_graduated`, led astray by nothing far off.

    ``poses``, ``weight`` : what that has led to from ``begin``; edges that it did not have are 0. It is done again from
    there without the ``doubtful (E,)`` ones that miss by more than ``RECALL`` bounds, for a wrong edge takes right
    ones with it before it is dropped; what agrees in the end is believed, where that is more than before.
    """
    for _ in range(RECALLS):
        tried = ~doubtful | (edges.chi2(poses) <= RECALL * bound)
        if (tried <= weight).all():
            break
        used = np.zeros(edges.first.size)
        together, used[tried] = relax_graduated(begin, edges.part(tried), doubtful[tried], bound)
        kept = np.where(doubtful & (edges.chi2(together) > bound), 0.0, 1.0)
        if not np.array_equal(kept, used):
            _settle(together, edges, _equations(edges, poses), kept)
        if kept.sum() <= weight.sum():
            break
        poses, weight = together, kept
    return poses, weight


def marginal(poses: Transform, edges: Edges, node: int) -> NDArray[np.float64]:
    """Return ``(3, 3)``, covariance of one pose, x, y and theta of the graph's frame; the first one is certain.

    The edges are all believed; ``poses (K, 3)`` is where it is linearised (Kaess and Dellaert 2009, equation 5).
    """
    if node == 0 or edges.first.size == 0:
        return np.zeros((3, 3))
    factors, _ = _factorised(poses, edges, _equations(edges, poses), np.ones(edges.first.size))
    columns = np.zeros((3, poses.shape[0] - 1, 3))
    columns[:, node - 1] = np.eye(3)
    cov = np.array([factors.solve(column)[node - 1] for column in columns])
    return np.asarray(0.5 * (cov + cov.T))


def _anneal(
    poses: Transform,
    edges: Edges,
    equations: NormalEquations,
    doubtful: NDArray[np.bool_],
    bound: float,
    worst: float,
) -> None:
    """Relax the poses in place under a loss that becomes sharper, from convex for squared lengths up to ``worst``."""
    mu, weight = bound / (2.0 * worst - bound), np.ones(edges.first.size)
    for _ in range(ANNEALING_STEPS):
        before = weight
        weight = np.where(doubtful, _truncated(edges.chi2(poses), bound, mu), 1.0)
        moved = _step(poses, edges, equations, weight)
        certain = bool(((weight < 1e-3) | (weight > 1.0 - 1e-3)).all())
        if certain and moved < SETTLED_M and np.array_equal(before, weight):
            return
        mu *= ANNEALING


def _truncated(chi2: NDArray[np.float64], bound: float, mu: float) -> NDArray[np.float64]:
    """Return the weights of the surrogate of truncated least squares (Yang et al. 2020, equation 14)."""
    between = np.sqrt(bound * mu * (mu + 1.0) / np.maximum(chi2, 1e-12)) - mu
    return np.where(chi2 >= (mu + 1.0) / mu * bound, 0.0, np.where(chi2 <= mu / (mu + 1.0) * bound, 1.0, between))


def _settle(poses: Transform, edges: Edges, equations: NormalEquations, weight: NDArray[np.float64]) -> None:
    """Relax the poses in place, with fixed weights."""
    for _ in range(ITERATIONS):
        if _step(poses, edges, equations, weight) < SETTLED_M:
            return


def _step(poses: Transform, edges: Edges, equations: NormalEquations, weight: NDArray[np.float64]) -> float:
    """Take one Gauss-Newton step in place, and return the largest change, metres or radians; the first pose stays."""
    factors, rhs = _factorised(poses, edges, equations, weight)
    step = factors.solve(rhs)
    poses[1:] += step
    poses[:, 2] = se2.wrap(poses[:, 2])
    return float(np.abs(step).max())


def _factorised(
    poses: Transform, edges: Edges, equations: NormalEquations, weight: NDArray[np.float64]
) -> tuple[Factors, Transform]:
    return equations.factorised(poses, edges.residuals(poses), edges.information, weight)


def _equations(edges: Edges, poses: Transform) -> NormalEquations:
    return NormalEquations(edges.first, edges.second, poses.shape[0])
