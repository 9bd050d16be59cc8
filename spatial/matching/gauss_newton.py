"""Scan matching: Gauss-Newton on point-to-line distances to the mean hit points of the cells around each beam's end."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.axes import eigenvalues, least_axis
from mrslam.spatial.matching.beam_sums import Sums, Weighting, sum_beams

CORRIDOR = 0.05
"""Where the least eigenvalue of the position's information is less than this share of the greatest, the scan is taken
to be of a corridor, and normals along it are corrected."""
CREDIBLE_BEAMS = 1.0
"""Information along a corridor, in beams of full weight, up to which it is taken out as chance; from twice this
on it is kept."""
WIDE_STEPS, WIDE_SIGMAS, WIDE_M, NARROW_SIGMAS = 2, 3.0, 0.12, 1.5
"""Scale of the robust loss: in the first ``WIDE_STEPS`` iterations ``WIDE_SIGMAS`` sigmas, at least ``WIDE_M`` metres;
in the later ones ``NARROW_SIGMAS`` sigmas."""
STEP_MOST_M, TURN_MOST_RAD = 0.3, 0.2
"""Longest step of one iteration: beyond, the surfaces found belong to other things."""
SETTLED_M2, SETTLED_RAD2 = 1e-6, 1e-7
"""A pose that moves by less, squared, has settled: a millimetre, and 0.3 mrad."""
DAMPING = 1e-3
"""Added to the diagonal of the normal equations, so that they can be solved where nothing was seen."""


class Match(NamedTuple):
    """How a scan fits a map best."""

    pose: NDArray[np.float64]
    """``(3,)``, x, y (m) and theta (rad) of the scan in the map's frame."""
    score: float
    """Mean log-likelihood of a beam relative to a perfect fit, at most 0."""
    inliers: float
    """Share of beams within 2.5 sigma of the map, 0..1."""
    conflicts: float
    """Share of beams that end in space the map knows to be free, 0..1."""
    information: NDArray[np.float64]
    """``(3, 3)``, inverse covariance of the pose by the beams alone, map frame, without the prior: 1/m^2, 1/(m rad),
    1/rad^2."""
    blind: float
    """0..1: how far the beams leave the position along ``blind_direction`` open; 0 where all directions are seen."""
    blind_direction: NDArray[np.float64]
    """``(2,)``, unit vector of the direction seen least in the map's frame; means nothing where ``blind`` is 0."""


@njit(cache=True, nogil=True)
def match(
    tiles: Tiles,
    points: NDArray[np.float64],
    start: NDArray[np.float64],
    prior: NDArray[np.float64],
    prior_info: NDArray[np.float64],
    sigma_m: float,
    iterations: int,
) -> Match:  # pragma: no cover - compiled
    """Return the pose that fits ``points (N, 5)`` best, beginning at ``start (3,)``.

    Minimises the robust sum of squared point-to-line distances over ``sigma_m``, plus the prior
    ``(x - prior)^T prior_info (x - prior)``, ``prior (3,)``, ``prior_info (3, 3)``, in at most ``iterations`` steps.
    Poses are of the base in the map. Errors of normals feign information along a corridor; it is taken out, and if
    hardly anything is left, only the prior counts there (solution remapping, Zhang, Kaess and Singh 2016).
    """
    x, y, theta = start[0], start[1], start[2]
    weight = 1.0 / (sigma_m * sigma_m)
    step = 0
    settled = False
    blind, along_x, along_y = 0.0, 1.0, 0.0
    corridor = False
    while True:
        final = settled or step >= iterations
        # Wide at first, to draw in what is off; narrow at the end, to leave out what does not belong.
        is_wide = step < WIDE_STEPS
        scale_m = max(WIDE_SIGMAS * sigma_m, WIDE_M) if is_wide else NARROW_SIGMAS * sigma_m
        weighting = Weighting(3 if is_wide else 2, scale_m**2, weight, corridor, along_x, along_y)
        sums = sum_beams(tiles, points, x, y, theta, weighting)
        least, most = eigenvalues(sums.xx, sums.xy, sums.yy)
        blind = min(max(2.0 - least / (CREDIBLE_BEAMS * weight), 0.0), 1.0) if corridor else 0.0
        corridor = least < CORRIDOR * most
        if corridor or blind > 0.0:  # the direction has to be this step's: along another one, too much is taken out
            along_x, along_y = least_axis(sums.xx, sums.xy, sums.yy)
        if blind > 0.0:
            sums = _without(sums, blind, least, along_x, along_y)
        if final:
            break
        dx, dy, dt, norm2 = _limited(_solve(sums, x, y, theta, prior, prior_info))
        x, y, theta = x + dx, y + dy, theta + dt
        settled = step >= WIDE_STEPS and norm2 < SETTLED_M2 and dt * dt < SETTLED_RAD2
        step += 1
    pose = np.empty(3)
    pose[0], pose[1] = x, y
    pose[2] = theta - 2.0 * math.pi * math.floor((theta + math.pi) / (2.0 * math.pi))
    return _result(sums, pose, max(points.shape[0], 1), blind, along_x, along_y)


@njit(cache=True, nogil=True)
def _limited(step: tuple[float, float, float]) -> tuple[float, float, float, float]:  # pragma: no cover - compiled
    """Return a step (m, m, rad) cut to the longest one, and the squared length of the whole one, m^2."""
    dx, dy, dt = step
    norm2 = dx * dx + dy * dy
    if norm2 > STEP_MOST_M * STEP_MOST_M:
        shrink = STEP_MOST_M / math.sqrt(norm2)
        dx, dy, dt = dx * shrink, dy * shrink, dt * shrink
    return dx, dy, min(max(dt, -TURN_MOST_RAD), TURN_MOST_RAD), norm2


@njit(cache=True, nogil=True)
def _result(
    sums: Sums, pose: NDArray[np.float64], beams: int, blind: float, along_x: float, along_y: float
) -> Match:  # pragma: no cover - compiled
    """Return the match at a pose ``(3,)`` from the sums over a number of ``beams``."""
    information = np.empty((3, 3))
    information[0, 0], information[1, 1], information[2, 2] = sums.xx, sums.yy, sums.tt
    information[0, 1] = information[1, 0] = sums.xy
    information[0, 2] = information[2, 0] = sums.xt
    information[1, 2] = information[2, 1] = sums.yt
    direction = np.empty(2)
    direction[0], direction[1] = along_x, along_y
    return Match(pose, sums.score / beams, sums.inliers / beams, sums.conflicts / beams, information, blind, direction)


@njit(cache=True, nogil=True)
def _without(
    sums: Sums, blind: float, least: float, along_x: float, along_y: float
) -> Sums:  # pragma: no cover - compiled
    """Return the equations without a share ``blind`` of what they say along a direction, whose eigenvalue is ``least``.

    ``S H S`` and ``S b`` with ``S = 1 - (1 - sqrt(1 - blind)) e e^T``.
    """
    along = blind * (along_x * sums.bx + along_y * sums.by)
    bx = sums.bx - along * along_x
    by = sums.by - along * along_y
    k = 1.0 - math.sqrt(1.0 - blind)
    along = k * (along_x * sums.xt + along_y * sums.yt)
    xt = sums.xt - along * along_x
    yt = sums.yt - along * along_y
    along = blind * least
    xx = sums.xx - along * along_x * along_x
    xy = sums.xy - along * along_x * along_y
    yy = sums.yy - along * along_y * along_y
    return Sums(xx, xy, xt, yy, yt, sums.tt, bx, by, sums.bt, sums.score, sums.inliers, sums.conflicts)


@njit(cache=True, nogil=True)
def _solve(
    sums: Sums,
    x: float,
    y: float,
    theta: float,
    prior: NDArray[np.float64],
    prior_info: NDArray[np.float64],
) -> tuple[float, float, float]:  # pragma: no cover - compiled
    """Return the Gauss-Newton step from a pose, prior included, by Cholesky's decomposition."""
    ex, ey = prior[0] - x, prior[1] - y
    et = prior[2] - theta
    et -= 2.0 * math.pi * math.floor((et + math.pi) / (2.0 * math.pi))
    axx, axy, axt = sums.xx + prior_info[0, 0] + DAMPING, sums.xy + prior_info[0, 1], sums.xt + prior_info[0, 2]
    ayy, ayt, att = (
        sums.yy + prior_info[1, 1] + DAMPING,
        sums.yt + prior_info[1, 2],
        sums.tt + prior_info[2, 2] + DAMPING,
    )
    gx = sums.bx + prior_info[0, 0] * ex + prior_info[0, 1] * ey + prior_info[0, 2] * et
    gy = sums.by + prior_info[0, 1] * ex + prior_info[1, 1] * ey + prior_info[1, 2] * et
    gt = sums.bt + prior_info[0, 2] * ex + prior_info[1, 2] * ey + prior_info[2, 2] * et
    l11 = math.sqrt(axx)
    l21, l31 = axy / l11, axt / l11
    l22 = math.sqrt(max(ayy - l21 * l21, 1e-9))
    l32 = (ayt - l31 * l21) / l22
    l33 = math.sqrt(max(att - l31 * l31 - l32 * l32, 1e-9))
    z1 = gx / l11
    z2 = (gy - l21 * z1) / l22
    z3 = (gt - l31 * z1 - l32 * z2) / l33
    dt = z3 / l33
    dy = (z2 - l32 * dt) / l22
    dx = (z1 - l21 * dy - l31 * dt) / l11
    return dx, dy, dt
