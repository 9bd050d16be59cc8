"""Proposals where a prior says that the maps lie: a lattice of places, close enough that settling leads to any fit."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.result import Prior
from mrslam.spatial import se2

PRIOR_SIGMAS = 4.0
"""Places farther than this from the prior are not looked at; a true one is so once in 900 (chi-square, 3 degrees)."""
APART_M, APART_RAD = 0.4, math.radians(1.0)
"""From one place to the next: settling finds walls within 0.6 m."""
MOST = 1000
"""Most places; of more, a correlation of the whole maps costs less."""


def lattice(b: PreparedMap, prior: Prior) -> se2.Transform | None:
    """Return places ``T_a_b (N, 3)`` that cover what a prior says of map b's, or None where they would be too many.

    For each heading those that are ``PRIOR_SIGMAS`` or less from it: a heading that is off takes the place with it, by
    the prior's covariance, and the walls of a map that lie far from its origin farther than that.
    """
    C = np.asarray(prior.covariance, dtype=np.float64)
    turn_rad2 = max(C[2, 2], 1e-12)
    carried = C[:2, 2] / turn_rad2  # metres the place moves by a radian
    rest_m2 = C[:2, :2] - np.outer(carried, C[:2, 2]) + 1e-12 * np.eye(2)
    x, y = se2.apply(np.array([0.0, 0.0, prior.T_a_b[2]]), b.centre)
    lever_m = float(np.hypot(*(carried + np.array([-y, x]))))
    step_rad = min(APART_RAD, APART_M / max(lever_m, 1e-9))
    steps = np.floor(PRIOR_SIGMAS * np.sqrt([*np.diag(rest_m2), turn_rad2]) / [APART_M, APART_M, step_rad])
    if np.prod(2.0 * steps + 1.0) > 10 * MOST:
        return None
    off = np.stack(np.meshgrid(*(np.arange(-n, n + 1.0) for n in steps), indexing="ij"), axis=-1).reshape(-1, 3)
    off *= [APART_M, APART_M, step_rad]
    away2 = np.einsum("ni,ni->n", off[:, :2] @ np.linalg.inv(rest_m2), off[:, :2]) + off[:, 2] ** 2 / turn_rad2
    off = off[away2 <= PRIOR_SIGMAS**2]
    if len(off) > MOST:
        return None
    off[:, :2] += off[:, 2:] * carried
    places: se2.Transform = prior.T_a_b + off
    places[:, 2] = se2.wrap(places[:, 2])
    return places
