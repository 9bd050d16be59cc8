"""Joint least squares over all alignments of a team."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.edges import Edge
from mrslam.spatial import se2

ITERATIONS = 30
"""Most Gauss-Newton steps: bounds the time where robust weights make the last ones small."""
FLOOR = np.diag([0.01**2, 0.01**2, 0.001**2])
"""Covariance added to every alignment, m^2 and rad^2: none is better than 1 cm (a fifth of a cell) and 1 mrad."""


def jointly(
    T_anchor_map: Mapping[str, se2.Transform], edges: Iterable[Edge], anchor: str, config: MergeConfig
) -> dict[str, se2.Transform]:
    """Return the poses ``T_anchor_map (3,)`` that fit all edges best, from a first guess, by robot id.

    Gauss-Newton on SE(2) with Cauchy weights; the anchor's pose is the identity and stays it. Robots and edges are
    taken in the order of their ids, so that the result depends on nothing else.
    """
    free = [robot_id for robot_id in sorted(T_anchor_map) if robot_id != anchor]
    ids = [*free, anchor]
    index, poses = {robot_id: i for i, robot_id in enumerate(ids)}, np.array([T_anchor_map[x] for x in ids])
    chosen = sorted((edge for edge in edges if edge.a in index and edge.b in index), key=lambda edge: edge.pair)
    if len(chosen) <= len(free):
        return {x: poses[index[x]] for x in sorted(ids)}  # a tree fits its edges exactly
    information = np.linalg.inv(np.array([config.covariance_scale * edge.covariance + FLOOR for edge in chosen]))
    T_a_b = np.array([edge.T_a_b for edge in chosen])
    ends = np.array([(index[edge.a], index[edge.b]) for edge in chosen]).T
    for _ in range(ITERATIONS):
        residual, *J = _residual(poses[ends[0]], poses[ends[1]], T_a_b)
        squares = np.einsum("ei,eij,ej->e", residual, information, residual)
        weighted = information / (1.0 + squares / config.robust_sigmas**2)[:, None, None]
        normal, gradient = np.zeros((len(ids), len(ids), 3, 3)), np.zeros((len(ids), 3))
        for i, J_i in zip(ends, J, strict=True):
            np.add.at(gradient, i, np.einsum("eji,ejk,ek->ei", J_i, weighted, residual))
            for j, J_j in zip(ends, J, strict=True):
                np.add.at(normal, (i, j), np.einsum("eji,ejk,ekl->eil", J_i, weighted, J_j))
        # The anchor, which is last, stays. The damping keeps the system regular, far below what any alignment says.
        count = 3 * len(free)
        square = normal.swapaxes(1, 2).reshape(count + 3, count + 3)[:count, :count]
        step = -np.linalg.solve(square + 1e-9 * np.eye(count), gradient.ravel()[:count]).reshape(-1, 3)
        poses[:-1] += step
        poses[:-1, 2] = se2.wrap(poses[:-1, 2])
        if float(np.abs(step).max()) < 1e-9:
            break
    return {x: poses[index[x]] for x in sorted(ids)}


def _residual(
    T_w_a: se2.Transform, T_w_b: se2.Transform, T_a_b: se2.Transform
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return predicted minus measured ``T_a_b (E, 3)``, and its Jacobians ``(E, 3, 3)`` with respect to both poses."""
    predicted = se2.between(T_w_a, T_w_b)
    residual = predicted - T_a_b
    residual[:, 2] = se2.wrap(residual[:, 2])
    cos, sin = np.cos(T_w_a[:, 2]), np.sin(T_w_a[:, 2])
    J_b = np.zeros((len(residual), 3, 3))
    J_b[:, 0, 0], J_b[:, 0, 1], J_b[:, 1, 0], J_b[:, 1, 1], J_b[:, 2, 2] = cos, sin, -sin, cos, 1.0
    J_a = -J_b
    J_a[:, 0, 2], J_a[:, 1, 2] = predicted[:, 1], -predicted[:, 0]
    return residual, J_a, J_b
