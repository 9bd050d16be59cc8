"""The particles: improved proposal, weights and maps, for a range of them at a time, so that threads share the work.

Grisetti, Stachniss, Burgard 2007, section III. Their K samples around the matched pose serve to find the mean, spread
and mass of p(z | m, x) p(x | x', u). Here the matcher already minimises the negative logarithm of that product and
gives its curvature, so the Gaussian is had in closed form (Laplace): mu = the matched pose, Sigma = (H + Q^-1)^-1.
The weight takes the product at its peak, tempered (``evidence_beams``, ``PRIOR_SHARE``), and no determinant of Sigma.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.rbpf.front_end.motion import Agreement
from mrslam.spatial.hits.drawing import insert_scan
from mrslam.spatial.hits.views import Beams, Maps, map_of
from mrslam.spatial.matching.gauss_newton import match

CORRELATED = 0.8
"""Share of the matcher's information that the proposal gets: beams are not independent of each other."""
PRIOR_SHARE = 0.25
"""Share of the motion prior's log-density in the weights; tempers like ``evidence_beams`` does for beams."""
PRIOR_MOST = 20.0
"""Largest squared Mahalanobis distance from the motion that a weight counts: one slip kills no particle."""
FARTHEST2 = 36.0
"""Squared Mahalanobis distance from the motion beyond which no match is believed: 6 sigma. Of 60 000 on four recorded
logs the farthest was at 24."""
ITERATIONS = 8
"""Steps of the matcher: particles begin within centimetres of the match."""


class Motion(NamedTuple):
    """Motion between two keyframes, in the frame of the first."""

    mean: NDArray[np.float64]
    """``(3,)``, metres and radians."""
    cov: NDArray[np.float64]
    """``(3, 3)``, m^2, m rad, rad^2."""


class Proposals(NamedTuple):
    """New poses of N particles at a keyframe, and how the scan fits their maps."""

    poses: NDArray[np.float64]
    """``(N, 3)``, drawn from the improved proposal, map frame."""
    gains: NDArray[np.float64]
    """``(N,)``, added to the log weights."""
    inliers: NDArray[np.float64]
    """``(N,)``, share of beams that fit the particle's map, 0..1."""
    conflicts: NDArray[np.float64]
    """``(N,)``, share of beams that contradict it, 0..1."""
    information: NDArray[np.float64]
    """``(N, 3, 3)``, inverse covariance of each pose by the scan alone, map frame: 1/m^2, 1/(m rad), 1/rad^2."""

    def agreement(self, index: int) -> Agreement:
        """Return how far a particle's map agrees with the scan."""
        c, s = math.cos(self.poses[index, 2]), math.sin(self.poses[index, 2])
        T_map_key = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        return Agreement(
            inliers=float(self.inliers[index]), conflicts=float(self.conflicts[index]),
            information=T_map_key.T @ self.information[index] @ T_map_key,
        )  # fmt: skip

    @classmethod
    def empty(cls, count: int) -> Proposals:
        """Return arrays for ``count`` particles."""
        return cls(np.empty((count, 3)), np.empty(count), np.empty(count), np.empty(count), np.empty((count, 3, 3)))


@njit(cache=True, nogil=True)
def propose(
    maps: Maps,
    points: NDArray[np.float64],
    before: NDArray[np.float64],
    motion: Motion,
    noise: NDArray[np.float64],
    sigma_m: float,
    evidence_beams: float,
    first: int,
    last: int,
    out: Proposals,
) -> None:  # pragma: no cover - compiled
    """Draw new poses for particles ``first .. last - 1`` from their improved proposals, and write them to ``out``.

    ``points (n, 5)`` of the scan, ``before (N, 3)`` the particles at the keyframe before, ``noise (N, 3)`` standard
    normal draws.
    """
    predicted, info = np.empty(3), np.empty((3, 3))
    least = 1.0 / (motion.cov[0, 0] + motion.cov[1, 1] + motion.cov[2, 2])
    for i in range(first, last):
        c, s = math.cos(before[i, 2]), math.sin(before[i, 2])
        predicted[0] = before[i, 0] + c * motion.mean[0] - s * motion.mean[1]
        predicted[1] = before[i, 1] + s * motion.mean[0] + c * motion.mean[1]
        predicted[2] = before[i, 2] + motion.mean[2]
        info[:, :] = np.linalg.inv(_turned(motion.cov, c, s))
        fit = match(map_of(maps, i), points, predicted, predicted, info, sigma_m, ITERATIONS)
        out.inliers[i], out.conflicts[i] = fit.inliers, fit.conflicts
        prior = _distance2(fit.pose, predicted, info)
        if not prior <= FARTHEST2:  # no evidence carries a particle farther: it keeps the motion, and what that fits
            fit = match(map_of(maps, i), points, predicted, predicted, info, sigma_m, 0)
            prior = 0.0
        out.gains[i] = evidence_beams * fit.score - 0.5 * PRIOR_SHARE * min(prior, PRIOR_MOST)
        out.information[i] = fit.information
        for row in range(3):
            for col in range(row, 3):
                info[row, col] += CORRELATED * fit.information[row, col]
        _draw(fit.pose, info, least, noise[i], out.poses[i])


@njit(cache=True, nogil=True)
def _turned(cov: NDArray[np.float64], c: float, s: float) -> NDArray[np.float64]:  # pragma: no cover - compiled
    """Return the covariance ``(3, 3)`` of a motion in the map frame, ``R Q R^T``, from cos and sin of the heading."""
    q = np.empty((3, 3))
    xx, xy, yy = cov[0, 0], cov[0, 1], cov[1, 1]
    xt, yt = cov[0, 2], cov[1, 2]
    q[0, 0] = c * c * xx - 2.0 * c * s * xy + s * s * yy
    q[0, 1] = c * s * (xx - yy) + (c * c - s * s) * xy
    q[1, 1] = s * s * xx + 2.0 * c * s * xy + c * c * yy
    q[0, 2] = c * xt - s * yt
    q[1, 2] = s * xt + c * yt
    q[1, 0], q[2, 0], q[2, 1] = q[0, 1], q[0, 2], q[1, 2]
    q[2, 2] = cov[2, 2]
    return q


@njit(cache=True, nogil=True)
def _distance2(
    pose: NDArray[np.float64], mean: NDArray[np.float64], info: NDArray[np.float64]
) -> float:  # pragma: no cover - compiled
    """Return the squared Mahalanobis distance of two poses ``(3,)`` under ``info (3, 3)``, an inverse covariance."""
    dx, dy = pose[0] - mean[0], pose[1] - mean[1]
    dt = pose[2] - mean[2]
    dt -= 2.0 * math.pi * math.floor((dt + math.pi) / (2.0 * math.pi))
    return (
        info[0, 0] * dx * dx + info[1, 1] * dy * dy + info[2, 2] * dt * dt
        + 2.0 * (info[0, 1] * dx * dy + info[0, 2] * dx * dt + info[1, 2] * dy * dt)
    )  # fmt: skip


@njit(cache=True, nogil=True)
def _draw(
    mean: NDArray[np.float64],
    info: NDArray[np.float64],
    least: float,
    noise: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:  # pragma: no cover - compiled
    """Write a pose ``(3,)`` drawn from N(mean, info^-1), of whose ``info (3, 3)`` the upper triangle is read.

    ``least`` : no direction is known worse than this, 1/m^2 or 1/rad^2, whatever rounding makes of ``info``.
    """
    # x = mu + L^-T z has covariance (L L^T)^-1.
    l11 = math.sqrt(max(info[0, 0], least))
    l21, l31 = info[0, 1] / l11, info[0, 2] / l11
    l22 = math.sqrt(max(info[1, 1] - l21 * l21, least))
    l32 = (info[1, 2] - l31 * l21) / l22
    l33 = math.sqrt(max(info[2, 2] - l31 * l31 - l32 * l32, least))
    ut = noise[2] / l33
    uy = (noise[1] - l32 * ut) / l22
    ux = (noise[0] - l21 * uy - l31 * ut) / l11
    out[0] = mean[0] + ux
    out[1] = mean[1] + uy
    theta = mean[2] + ut
    out[2] = theta - 2.0 * math.pi * math.floor((theta + math.pi) / (2.0 * math.pi))


@njit(cache=True, nogil=True)
def insert_range(
    maps: Maps, beams: Beams, poses: NDArray[np.float64], skip_m: float, first: int, last: int
) -> None:  # pragma: no cover - compiled
    """Add one scan to the maps of particles ``first .. last - 1``, at ``poses (N, 3)``."""
    for i in range(first, last):
        insert_scan(map_of(maps, i), maps.refs, beams, poses[i], skip_m)
