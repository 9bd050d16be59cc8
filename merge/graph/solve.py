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
    ids = [robot_id for robot_id in sorted(T_anchor_map) if robot_id != anchor]
    index = {robot_id: 3 * i for i, robot_id in enumerate(ids)}
    poses = {robot_id: np.array(T_anchor_map[robot_id]) for robot_id in sorted(T_anchor_map)}
    chosen = sorted((edge for edge in edges if edge.a in poses and edge.b in poses), key=lambda edge: edge.pair)
    information = [np.linalg.inv(config.covariance_scale * edge.covariance + FLOOR) for edge in chosen]
    if len(chosen) <= len(ids):
        return poses  # a tree fits its edges exactly
    for _ in range(ITERATIONS):
        normal, gradient = np.zeros((3 * len(ids), 3 * len(ids))), np.zeros(3 * len(ids))
        for edge, info in zip(chosen, information, strict=True):
            residual, J_a, J_b = _residual(poses[edge.a], poses[edge.b], edge.T_a_b)
            weight = 1.0 / (1.0 + float(residual @ info @ residual) / config.robust_sigmas**2)
            blocks = [(index[x], J) for x, J in ((edge.a, J_a), (edge.b, J_b)) if x in index]
            for i, J_i in blocks:
                gradient[i : i + 3] += weight * (J_i.T @ info @ residual)
                for j, J_j in blocks:
                    normal[i : i + 3, j : j + 3] += weight * (J_i.T @ info @ J_j)
        # The damping keeps the system regular; it is far below the information of any alignment.
        step = -np.linalg.solve(normal + 1e-9 * np.eye(len(gradient)), gradient)
        for robot_id, i in index.items():
            pose = poses[robot_id] + step[i : i + 3]
            poses[robot_id] = se2.transform(*pose)
        if float(np.abs(step).max()) < 1e-9:
            break
    return poses


def _residual(
    T_w_a: se2.Transform, T_w_b: se2.Transform, T_a_b: se2.Transform
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return predicted minus measured ``T_a_b (3,)``, and its Jacobians ``(3, 3)`` with respect to both poses."""
    predicted = se2.between(T_w_a, T_w_b)
    residual = predicted - T_a_b
    residual[2] = se2.wrap(residual[2])
    cos, sin = np.cos(T_w_a[2]), np.sin(T_w_a[2])
    J_b = np.array([[cos, sin, 0.0], [-sin, cos, 0.0], [0.0, 0.0, 1.0]])
    J_a = -J_b.copy()
    J_a[0, 2], J_a[1, 2] = predicted[1], -predicted[0]
    return residual, J_a, J_b
