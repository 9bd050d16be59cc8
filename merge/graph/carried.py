"""Alignments seen from other maps: what is known of a and b, told of x and b or of a and x."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrslam.alignment import Alignment
from mrslam.merge.graph.edges import inverse_covariance
from mrslam.spatial import se2


def moved(found: Alignment, T_x_a: se2.Transform) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_x_b``."""
    J = np.eye(3)
    J[:2, :2] = se2.matrix(T_x_a)[:2, :2]
    return replace(found, T_a_b=se2.compose(T_x_a, found.T_a_b), covariance=J @ found.covariance @ J.T)


def seen_from(found: Alignment, T_b_x: se2.Transform) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_a_x``; the shift's lever couples position to heading."""
    lever = se2.matrix(found.T_a_b)[:2, :2] @ T_b_x[:2]
    J = np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]])
    return replace(found, T_a_b=se2.compose(found.T_a_b, T_b_x), covariance=J @ found.covariance @ J.T)


def turned(found: Alignment) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_b_a``."""
    covariance = inverse_covariance(found.T_a_b, found.covariance)
    return replace(found, T_a_b=se2.inverse(found.T_a_b), covariance=covariance)
