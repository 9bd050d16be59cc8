"""Relaxation of one trajectory: keyframes, the motions between them, and the places that were seen again."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import splu

from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

ROUNDS = 4
SETTLED_M = 1e-3


def relax(
    T_map_key: Transform,
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    T_first_second: Transform,
    information: NDArray[np.float64],
    robust: NDArray[np.bool_],
    robust_scale: float = 3.0,
) -> Transform:
    """Return the poses ``(K, 3)`` that fit the edges best, the first staying where it is (Luo and Milios 1997, SE(2)).

    Edge e says that ``second[e]`` is at ``T_first_second[e] (E, 3)`` in the frame of ``first[e]``, with
    ``information (E, 3, 3)``. Edges marked ``robust`` lose weight when they miss by more than ``robust_scale`` sigmas
    (Cauchy), so that a wrong one cannot bend the rest.
    """
    poses = np.array(T_map_key, dtype=np.float64)
    count = poses.shape[0]
    if count < 2 or first.size == 0:
        return poses
    for _ in range(ROUNDS):
        step = _solve(poses, first, second, T_first_second, information, robust, robust_scale)
        poses[:, :2] += step[:, :2]
        poses[:, 2] = se2.wrap(poses[:, 2] + step[:, 2])
        if np.abs(step).max() < SETTLED_M:
            break
    return poses


def residuals(poses: Transform, first: NDArray[np.int64], second: NDArray[np.int64], T: Transform) -> Transform:
    """Return ``(E, 3)``: where ``second`` is in the frame of ``first``, minus where the edge says it is."""
    error = se2.between(poses[first], poses[second]) - T
    error[:, 2] = se2.wrap(error[:, 2])
    return error


def _solve(
    poses: Transform,
    first: NDArray[np.int64],
    second: NDArray[np.int64],
    T: Transform,
    information: NDArray[np.float64],
    robust: NDArray[np.bool_],
    scale: float,
) -> Transform:
    edges, count = first.size, poses.shape[0]
    error = residuals(poses, first, second, T)
    cos, sin = np.cos(poses[first, 2]), np.sin(poses[first, 2])
    delta = poses[second, :2] - poses[first, :2]
    a, b = np.zeros((edges, 3, 3)), np.zeros((edges, 3, 3))
    b[:, 0, 0], b[:, 0, 1], b[:, 1, 0], b[:, 1, 1], b[:, 2, 2] = cos, sin, -sin, cos, 1.0
    a[:, :2, :2] = -b[:, :2, :2]
    a[:, 0, 2] = -sin * delta[:, 0] + cos * delta[:, 1]
    a[:, 1, 2] = -cos * delta[:, 0] - sin * delta[:, 1]
    a[:, 2, 2] = -1.0
    chi2 = np.einsum("ei,eij,ej->e", error, information, error)
    weight = np.where(robust, 1.0 / (1.0 + chi2 / scale**2), 1.0)
    weighted = information * weight[:, None, None]
    wa, wb = weighted @ a, weighted @ b
    blocks = [
        a.transpose(0, 2, 1) @ wa,
        a.transpose(0, 2, 1) @ wb,
        b.transpose(0, 2, 1) @ wa,
        b.transpose(0, 2, 1) @ wb,
    ]
    pairs = [(first, first), (first, second), (second, first), (second, second)]
    axis = np.arange(3)
    rows = np.concatenate([(3 * i[:, None, None] + axis[:, None] + 0 * axis).ravel() for i, _ in pairs])
    cols = np.concatenate([(3 * j[:, None, None] + 0 * axis[:, None] + axis).ravel() for _, j in pairs])
    values = np.concatenate([block.ravel() for block in blocks])
    rhs = np.zeros(3 * count)
    np.add.at(rhs, (3 * first[:, None] + axis).ravel(), -np.einsum("eji,ej->ei", wa, error).ravel())
    np.add.at(rhs, (3 * second[:, None] + axis).ravel(), -np.einsum("eji,ej->ei", wb, error).ravel())
    free = (rows >= 3) & (cols >= 3)
    size = 3 * count - 3
    rows = np.concatenate([rows[free] - 3, np.arange(size)])
    cols = np.concatenate([cols[free] - 3, np.arange(size)])
    values = np.concatenate([values[free], np.full(size, 1e-6)])
    matrix = coo_matrix((values, (rows, cols)), shape=(size, size)).tocsc()
    solution = splu(matrix, permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}, diag_pivot_thresh=0.0).solve(
        rhs[3:]
    )
    step = np.zeros((count, 3))
    step[1:] = solution.reshape(-1, 3)
    return step
