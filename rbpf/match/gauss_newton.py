"""Scan matching: Gauss-Newton on point-to-line distances to the mean hit points of the cells around each beam's end."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.rbpf.match.nearest import COS, SIN, Surface, nearest
from mrslam.rbpf.tiles.views import Tiles

POINT_WEIGHT = 0.2
"""Weight of a correspondence without a normal beside one with: it holds the pose both ways, and less surely."""
CORRIDOR = 0.05
"""Where the beams tell less than this share along one direction of that across, they are looked at closer."""
SLANT_RAD = 0.25
"""Normals that look along a corridor by less than this are those of its walls, with their errors."""
CREDIBLE_BEAMS = 1.0
"""Beams that look along a corridor and are worth less than this many, all together, may be chance."""
QUALITY_LEAST = 0.2
"""A point's normal is used where its quality is above this."""
WIDE_STEPS = 2
"""The first steps look at surfaces farther off, and weigh them nearly as much as near ones."""
FAR_CELLS2 = 9.0
"""Surfaces farther off than the square root of this (cells) are others than the one that the beam hit."""
CONFLICT_COST, UNKNOWN_COST = 3.0, 1.0
"""What a beam that ends in known free space, and one that ends where nothing is known, take from the score; no beam
takes more than the first."""
INLIER_SIGMA2 = 6.25
"""A beam within 2.5 sigma of the map is an inlier."""
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
    """``(3, 3)``, of the pose by the beams alone, without the prior: 1/m^2, 1/(m rad), 1/rad^2."""
    blind: float
    """0..1: share of the direction seen least about which the beams say nothing."""
    blind_direction: NDArray[np.float64]
    """``(2,)``, unit vector of that direction in the map's frame."""


class _Sums(NamedTuple):
    """Normal equations over the beams: ``H step = b``, and how the beams fit."""

    xx: float
    xy: float
    xt: float
    yy: float
    yt: float
    tt: float
    bx: float
    by: float
    bt: float
    score: float
    inliers: float
    conflicts: float


class _Look(NamedTuple):
    """How one iteration weighs what beams find."""

    radius: int
    """Cells around a beam's end in which a surface is looked for where there is none next to it."""
    scale2: float
    """Square of the distance beyond which a beam loses weight (Geman-McClure), m^2."""
    weight: float
    """1 / sigma^2."""
    corridor: bool
    """Whether normals along the corridor are corrected."""
    along_x: float
    along_y: float
    """Unit vector along the corridor."""


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
    ``(x - prior)^T prior_info (x - prior)``, ``prior (3,)``, ``prior_info (3, 3)``. Errors of normals feign knowledge
    along a corridor; it is taken out, and if hardly anything is left, only the prior counts there (solution remapping,
    Zhang, Kaess and Singh 2016).
    """
    n = points.shape[0]
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
        scale2 = (max(3.0 * sigma_m, 0.12) if is_wide else 1.5 * sigma_m) ** 2
        look = _Look(3 if is_wide else 2, scale2, weight, corridor, along_x, along_y)
        sums = _sum_beams(tiles, points, x, y, theta, look)
        middle, half = 0.5 * (sums.xx + sums.yy), math.hypot(0.5 * (sums.xx - sums.yy), sums.xy)
        blind = 0.0
        if corridor:
            blind = min(max(2.0 - (middle - half) / (CREDIBLE_BEAMS * weight), 0.0), 1.0)
        corridor = middle - half < CORRIDOR * (middle + half)
        if corridor:
            angle = 0.5 * math.atan2(2.0 * sums.xy, sums.xx - sums.yy) + 0.5 * math.pi
            along_x, along_y = math.cos(angle), math.sin(angle)
        if blind > 0.0:
            sums = _without(sums, blind, middle - half, along_x, along_y)
        if final:
            break
        dx, dy, dt = _solve(sums, x, y, theta, prior, prior_info)
        norm2 = dx * dx + dy * dy
        if norm2 > STEP_MOST_M * STEP_MOST_M:
            shrink = STEP_MOST_M / math.sqrt(norm2)
            dx, dy, dt = dx * shrink, dy * shrink, dt * shrink
        dt = min(max(dt, -TURN_MOST_RAD), TURN_MOST_RAD)
        x += dx
        y += dy
        theta += dt
        settled = step >= WIDE_STEPS and norm2 < SETTLED_M2 and dt * dt < SETTLED_RAD2
        step += 1
    pose = np.empty(3)
    pose[0], pose[1] = x, y
    pose[2] = theta - 2.0 * math.pi * math.floor((theta + math.pi) / (2.0 * math.pi))
    information = np.empty((3, 3))
    information[0, 0], information[1, 1], information[2, 2] = sums.xx, sums.yy, sums.tt
    information[0, 1] = information[1, 0] = sums.xy
    information[0, 2] = information[2, 0] = sums.xt
    information[1, 2] = information[2, 1] = sums.yt
    direction = np.empty(2)
    direction[0], direction[1] = along_x, along_y
    beams = max(n, 1)
    return Match(pose, sums.score / beams, sums.inliers / beams, sums.conflicts / beams, information, blind, direction)


@njit(cache=True, nogil=True)
def _sum_beams(
    tiles: Tiles, points: NDArray[np.float64], x: float, y: float, theta: float, look: _Look
) -> _Sums:  # pragma: no cover - compiled
    """Return the normal equations of all beams at this pose."""
    resolution_m = tiles.resolution_m
    inv = 1.0 / resolution_m
    hxx = hxy = hxt = hyy = hyt = htt = 0.0
    bx = by = bt = 0.0
    score, inliers, conflicts = 0.0, 0.0, 0.0
    c, s = math.cos(theta), math.sin(theta)
    for i in range(points.shape[0]):
        rx = c * points[i, 0] - s * points[i, 1]
        ry = s * points[i, 0] + c * points[i, 1]
        quality = points[i, 4]
        nx = c * points[i, 2] - s * points[i, 3]
        ny = s * points[i, 2] + c * points[i, 3]
        surface = _surface(tiles, (x + rx) * inv, (y + ry) * inv, nx, ny, quality, look.radius)
        if surface.word == 0:
            if surface.visits > 0:
                conflicts += 1.0
                score -= CONFLICT_COST
            else:
                score -= UNKNOWN_COST
            continue
        dx = surface.dx * resolution_m
        dy = surface.dy * resolution_m
        line, mx, my = _normal(surface.word, nx, ny, quality, look)
        if line:
            r = mx * dx + my * dy  # map minus scan along the normal
            r2 = r * r
            w = look.scale2 / (look.scale2 + r2)
            w = w * w * look.weight
            jt = -mx * ry + my * rx
            hxx += w * mx * mx
            hxy += w * mx * my
            hyy += w * my * my
            hxt += w * mx * jt
            hyt += w * my * jt
            htt += w * jt * jt
            bx += w * mx * r
            by += w * my * r
            bt += w * jt * r
            # A line has no end in this model: count how far along it the map was seen, too.
            r2 += 0.1 * max(surface.distance2 * resolution_m * resolution_m - r2 - resolution_m * resolution_m, 0.0)
        else:
            r2 = dx * dx + dy * dy
            w = look.scale2 / (look.scale2 + r2)
            w = w * w * look.weight * POINT_WEIGHT
            hxx += w
            hyy += w
            hxt += -w * ry
            hyt += w * rx
            htt += w * (rx * rx + ry * ry)
            bx += w * dx
            by += w * dy
            bt += w * (-ry * dx + rx * dy)
        e = 0.5 * r2 * look.weight
        score -= min(e, CONFLICT_COST)
        if r2 * look.weight < INLIER_SIGMA2:
            inliers += 1.0
    return _Sums(hxx, hxy, hxt, hyy, hyt, htt, bx, by, bt, score, inliers, conflicts)


@njit(cache=True, nogil=True)
def _surface(
    tiles: Tiles, x: float, y: float, nx: float, ny: float, quality: float, radius: int
) -> Surface:  # pragma: no cover - compiled
    """Return the surface next to a beam's end, or else the nearest in a wider neighbourhood."""
    near = nearest(tiles, x, y, nx, ny, quality, 1)
    if near.word != 0:
        return near
    wide = nearest(tiles, x, y, nx, ny, quality, radius)
    if wide.word == 0 or wide.distance2 > FAR_CELLS2:
        return near
    return wide


@njit(cache=True, nogil=True)
def _normal(
    word: Any, nx: float, ny: float, quality: float, look: _Look
) -> tuple[bool, float, float]:  # pragma: no cover - compiled
    """Return whether a surface has a unit normal, by its cell's word or the beam's own ``(nx, ny)``, and which."""
    if (word >> 31) & 1 > 0:
        k = (word >> 23) & 0xFF
        mx, my = COS[k], SIN[k]
        if quality > QUALITY_LEAST:
            # Where beams are sparse the mean point's wall is known better from both sides.
            mx, my = mx + nx, my + ny
            norm = 1.0 / math.sqrt(mx * mx + my * my)
            mx *= norm
            my *= norm
    elif quality > QUALITY_LEAST:
        mx, my = nx, ny
    else:
        return False, 0.0, 0.0
    if look.corridor:
        slant = mx * look.along_x + my * look.along_y
        if abs(slant) < SLANT_RAD:
            mx, my = mx - slant * look.along_x, my - slant * look.along_y
            norm = 1.0 / math.sqrt(mx * mx + my * my)
            mx *= norm
            my *= norm
    return True, mx, my


@njit(cache=True, nogil=True)
def _without(
    sums: _Sums, blind: float, least: float, along_x: float, along_y: float
) -> _Sums:  # pragma: no cover - compiled
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
    return _Sums(xx, xy, xt, yy, yt, sums.tt, bx, by, sums.bt, sums.score, sums.inliers, sums.conflicts)


@njit(cache=True, nogil=True)
def _solve(
    sums: _Sums,
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
