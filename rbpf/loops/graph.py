"""Relaxation of one trajectory: keyframes, the motions between them, and the places that were seen again."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

ROUNDS = 4
"""Most Gauss-Newton steps: it bounds the time where a wrong edge keeps the trajectory from settling."""
SETTLED = 1e-3
"""A step that moves no pose by more, metres or radians, is the last."""
ROBUST_SIGMAS = 3.0
"""A robust edge that misses by this many sigmas counts half (Cauchy)."""
DAMPING = 1e-6
"""Added to the diagonal of the normal equations: keyframes that no edge holds stay where they are."""


class Edges(NamedTuple):
    """E relations between poses of one trajectory."""

    first: NDArray[np.int64]
    """``(E,)``, index of the pose in whose frame the edge is."""
    second: NDArray[np.int64]
    """``(E,)``, index of the pose that it places."""
    T_first_second: Transform
    """``(E, 3)``."""
    information: NDArray[np.float64]
    """``(E, 3, 3)``, in the frame of ``first``."""
    robust: NDArray[np.bool_]
    """``(E,)``: whether it loses weight when it misses by far, so that a wrong one cannot bend the rest."""


def relax(T_map_key: Transform, edges: Edges) -> Transform:
    """Return the poses ``(K, 3)`` that fit the edges best, the first staying where it is (Luo and Milios 1997)."""
    poses = np.array(T_map_key, dtype=np.float64)
    if poses.shape[0] < 2 or edges.first.size == 0:
        return poses
    for _ in range(ROUNDS):
        step = _step(poses, edges)
        poses[:, :2] += step[:, :2]
        poses[:, 2] = se2.wrap(poses[:, 2] + step[:, 2])
        if np.abs(step).max() < SETTLED:
            break
    return poses


def residuals(poses: Transform, edges: Edges) -> Transform:
    """Return ``(E, 3)``: where ``second`` is in the frame of ``first``, minus where the edge says it is."""
    error = se2.between(poses[edges.first], poses[edges.second]) - edges.T_first_second
    error[:, 2] = se2.wrap(error[:, 2])
    return error


def _step(poses: Transform, edges: Edges) -> Transform:
    """Return one Gauss-Newton step ``(K, 3)``, zero for the first pose."""
    count = poses.shape[0]
    error = residuals(poses, edges)
    chi2 = np.einsum("ei,eij,ej->e", error, edges.information, error)
    weight = np.where(edges.robust, 1.0 / (1.0 + chi2 / ROBUST_SIGMAS**2), 1.0)
    weighted = edges.information * weight[:, None, None]
    a, b = _jacobians(poses, edges)
    matrix, rhs = _normal_equations(edges, (a, b), weighted, error, count)
    solution = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0)
    step = np.zeros((count, 3))
    step[1:] = solution.solve(rhs).reshape(-1, 3)
    return step


def _jacobians(poses: Transform, edges: Edges) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return ``(E, 3, 3)`` derivatives of the residuals by the first and by the second pose."""
    first, second = edges.first, edges.second
    cos, sin = np.cos(poses[first, 2]), np.sin(poses[first, 2])
    delta = poses[second, :2] - poses[first, :2]
    a, b = np.zeros((first.size, 3, 3)), np.zeros((first.size, 3, 3))
    b[:, 0, 0], b[:, 0, 1], b[:, 1, 0], b[:, 1, 1], b[:, 2, 2] = cos, sin, -sin, cos, 1.0
    a[:, :2, :2] = -b[:, :2, :2]
    a[:, 0, 2] = -sin * delta[:, 0] + cos * delta[:, 1]
    a[:, 1, 2] = -cos * delta[:, 0] - sin * delta[:, 1]
    a[:, 2, 2] = -1.0
    return a, b


def _normal_equations(
    edges: Edges,
    jacobians: tuple[NDArray[np.float64], NDArray[np.float64]],
    information: NDArray[np.float64],
    error: NDArray[np.float64],
    count: int,
) -> tuple[Any, NDArray[np.float64]]:
    """Return the sparse matrix and the right-hand side for all poses but the first."""
    (a, b), first, second = jacobians, edges.first, edges.second
    wa, wb = information @ a, information @ b
    at, bt = a.transpose(0, 2, 1), b.transpose(0, 2, 1)
    blocks = [(first, first, at @ wa), (first, second, at @ wb), (second, first, bt @ wa), (second, second, bt @ wb)]
    axis = np.arange(3)
    rows = np.concatenate([(3 * i[:, None, None] + axis[:, None] + 0 * axis).ravel() for i, _, _ in blocks])
    cols = np.concatenate([(3 * j[:, None, None] + 0 * axis[:, None] + axis).ravel() for _, j, _ in blocks])
    values = np.concatenate([block.ravel() for _, _, block in blocks])
    rhs = np.zeros(3 * count)
    np.add.at(rhs, (3 * first[:, None] + axis).ravel(), -np.einsum("eji,ej->ei", wa, error).ravel())
    np.add.at(rhs, (3 * second[:, None] + axis).ravel(), -np.einsum("eji,ej->ei", wb, error).ravel())
    free = (rows >= 3) & (cols >= 3)
    size = 3 * count - 3
    rows = np.concatenate([rows[free] - 3, np.arange(size)])
    cols = np.concatenate([cols[free] - 3, np.arange(size)])
    values = np.concatenate([values[free], np.full(size, DAMPING)])
    return coo_matrix((values, (rows, cols)), shape=(size, size)).tocsc(), rhs[3:]
