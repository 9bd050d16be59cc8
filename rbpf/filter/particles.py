"""The particles: improved proposal, weights and maps, for a range of them at a time, so that threads share the work.

Grisetti, Stachniss, Burgard 2007, section III. Their K samples around the matched pose serve to find the mean, spread
and mass of p(z | m, x) p(x | x', u). Here the matcher already minimises the negative logarithm of that product and
gives its curvature, so the Gaussian is had in closed form (Laplace): mu = the matched pose, Sigma = (H + Q^-1)^-1.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.rbpf.match.gauss_newton import INFO, RESULT_SIZE, SCORE, match
from mrslam.rbpf.tiles.drawing import insert_scan

CORRELATED = 0.8
"""Beams are not independent of each other: the matcher's information counts by this share."""
PRIOR_SHARE = 0.25
"""Share of the motion prior's log-density in the weights; tempers like ``evidence_beams`` does for beams."""


@njit(cache=True, nogil=True)
def propose(
    pool: NDArray[np.uint32],
    tables: NDArray[np.int32],
    row0: int,
    col0: int,
    resolution_m: float,
    points: NDArray[np.float64],
    poses: NDArray[np.float64],
    motion: NDArray[np.float64],
    motion_cov: NDArray[np.float64],
    noise: NDArray[np.float64],
    sigma_m: float,
    evidence_beams: float,
    cos_table: NDArray[np.float64],
    sin_table: NDArray[np.float64],
    first: int,
    last: int,
    sampled: NDArray[np.float64],
    gain: NDArray[np.float64],
    results: NDArray[np.float64],
) -> None:  # pragma: no cover - compiled
    """Draw new poses for particles ``first .. last - 1`` from their improved proposals.

    ``poses (N, 3)`` before the ``motion (3,)`` with covariance ``motion_cov (3, 3)`` in the base frame before it;
    ``noise (N, 3)`` standard normal draws. Writes ``sampled (N, 3)``, log-weight ``gain (N,)`` and the matcher's
    ``results (N, 13)``.
    """
    predicted = np.empty(3)
    info = np.empty((3, 3))
    q = np.empty((3, 3))
    for i in range(first, last):
        c, s = math.cos(poses[i, 2]), math.sin(poses[i, 2])
        predicted[0] = poses[i, 0] + c * motion[0] - s * motion[1]
        predicted[1] = poses[i, 1] + s * motion[0] + c * motion[1]
        predicted[2] = poses[i, 2] + motion[2]
        # Q in the map frame: R Q R^T.
        xx, xy, yy = motion_cov[0, 0], motion_cov[0, 1], motion_cov[1, 1]
        xt, yt = motion_cov[0, 2], motion_cov[1, 2]
        q[0, 0] = c * c * xx - 2.0 * c * s * xy + s * s * yy
        q[0, 1] = c * s * (xx - yy) + (c * c - s * s) * xy
        q[1, 1] = s * s * xx + 2.0 * c * s * xy + c * c * yy
        q[0, 2] = c * xt - s * yt
        q[1, 2] = s * xt + c * yt
        q[1, 0], q[2, 0], q[2, 1] = q[0, 1], q[0, 2], q[1, 2]
        q[2, 2] = motion_cov[2, 2]
        info[:, :] = np.linalg.inv(q)
        match(
            pool, tables[i], row0, col0, resolution_m, points, predicted, predicted, info, sigma_m, 8, cos_table,
            sin_table, results[i],
        )  # fmt: skip
        dx, dy = results[i, 0] - predicted[0], results[i, 1] - predicted[1]
        dt = results[i, 2] - predicted[2]
        dt -= 2.0 * math.pi * math.floor((dt + math.pi) / (2.0 * math.pi))
        prior = (
            info[0, 0] * dx * dx + info[1, 1] * dy * dy + info[2, 2] * dt * dt
            + 2.0 * (info[0, 1] * dx * dy + info[0, 2] * dx * dt + info[1, 2] * dy * dt)
        )  # fmt: skip
        gain[i] = evidence_beams * results[i, SCORE] - 0.5 * PRIOR_SHARE * min(prior, 20.0)
        info[0, 0] += CORRELATED * results[i, INFO]
        info[0, 1] += CORRELATED * results[i, INFO + 1]
        info[0, 2] += CORRELATED * results[i, INFO + 2]
        info[1, 1] += CORRELATED * results[i, INFO + 3]
        info[1, 2] += CORRELATED * results[i, INFO + 4]
        info[2, 2] += CORRELATED * results[i, INFO + 5]
        # x = mu + L^-T z has covariance (L L^T)^-1.
        l11 = math.sqrt(max(info[0, 0], 1e-9))
        l21, l31 = info[0, 1] / l11, info[0, 2] / l11
        l22 = math.sqrt(max(info[1, 1] - l21 * l21, 1e-9))
        l32 = (info[1, 2] - l31 * l21) / l22
        l33 = math.sqrt(max(info[2, 2] - l31 * l31 - l32 * l32, 1e-9))
        ut = noise[i, 2] / l33
        uy = (noise[i, 1] - l32 * ut) / l22
        ux = (noise[i, 0] - l21 * uy - l31 * ut) / l11
        sampled[i, 0] = results[i, 0] + ux
        sampled[i, 1] = results[i, 1] + uy
        theta = results[i, 2] + ut
        sampled[i, 2] = theta - 2.0 * math.pi * math.floor((theta + math.pi) / (2.0 * math.pi))


@njit(cache=True, nogil=True)
def insert_range(
    pool: NDArray[np.uint32],
    refs: NDArray[np.int32],
    tables: NDArray[np.int32],
    row0: int,
    col0: int,
    resolution_m: float,
    origin: NDArray[np.float64],
    poses: NDArray[np.float64],
    points: NDArray[np.float64],
    ends: NDArray[np.float64],
    skip_m: float,
    first: int,
    last: int,
) -> None:  # pragma: no cover - compiled
    """Add one scan to the maps of particles ``first .. last - 1``, at ``poses (N, 3)``."""
    for i in range(first, last):
        insert_scan(pool, refs, tables[i], row0, col0, resolution_m, origin, poses[i], points, ends, skip_m)


__all__ = ["RESULT_SIZE", "insert_range", "propose"]
