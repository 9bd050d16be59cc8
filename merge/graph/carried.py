"""Alignments and their covariances expressed for other maps: ``T_a_b`` as ``T_x_b``, ``T_a_x`` or ``T_b_a``."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment import Alignment, Prior
from mrslam.merge.graph.edges import inverse_covariance
from mrslam.spatial import se2


def moved(found: Alignment, T_x_a: se2.Transform) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_x_b``; ``T_x_a (3,)`` is taken as exact."""
    J = np.eye(3)
    J[:2, :2] = se2.matrix(T_x_a)[:2, :2]
    return replace(found, T_a_b=se2.compose(T_x_a, found.T_a_b), covariance=J @ found.covariance @ J.T)


def seen_from(found: Alignment, T_b_x: se2.Transform) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_a_x``; ``T_b_x (3,)`` is exact, but a lever arm for the heading's error."""
    lever = se2.matrix(found.T_a_b)[:2, :2] @ T_b_x[:2]
    J = np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]])
    return replace(found, T_a_b=se2.compose(found.T_a_b, T_b_x), covariance=J @ found.covariance @ J.T)


def between(T_w_a: se2.Transform, T_w_b: se2.Transform, covariance: NDArray[np.float64]) -> Prior:
    """Return ``T_a_b`` of two poses ``(3,)`` in frame w, each with ``covariance (3, 3)`` in w, to first order.

    An error of a's heading displaces b by that angle times their distance: the farther apart, the weaker the prior.
    """
    T_a_b = se2.between(T_w_a, T_w_b)
    J_b = np.eye(3)
    J_b[:2, :2] = se2.matrix(se2.inverse(T_w_a))[:2, :2]
    J_a = -J_b
    J_a[:2, 2] = T_a_b[1], -T_a_b[0]
    return Prior(T_a_b, J_a @ covariance @ J_a.T + J_b @ covariance @ J_b.T)


def sigma_at(prior: Prior, point_b: NDArray[np.float64]) -> float:
    """Return the largest standard deviation of a point ``(2,)`` of map b in map a, metres: with its lever arm."""
    lever = se2.matrix(prior.T_a_b)[:2, :2] @ point_b
    J = np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]]])
    return float(np.sqrt(np.linalg.eigvalsh(J @ prior.covariance @ J.T)[-1]))


def turned(found: Alignment) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_b_a``."""
    covariance = inverse_covariance(found.T_a_b, found.covariance)
    return replace(found, T_a_b=se2.inverse(found.T_a_b), covariance=covariance)
