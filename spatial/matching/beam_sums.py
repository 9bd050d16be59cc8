"""What all beams of a scan say about its pose in a map: normal equations over point-to-line distances."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.hits.cells import NORMAL_QUALITY
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.nearest import COS, SIN, Surface, nearest

POINT_WEIGHT = 0.2
"""Weight of a correspondence without a normal, relative to one with: it holds both directions, less surely."""
SLANT_RAD = 0.25
"""Normals whose part along a corridor is less than this are those of its walls, slanted only by their errors."""
FAR_CELLS2 = 9.0
"""Square of the distance (cells^2) beyond which the nearest surface is not the one that the beam hit."""
CONFLICT_COST, UNKNOWN_COST = 3.0, 1.0
"""What a beam that ends in known free space, and one that ends in unknown space, take from the score; no beam takes
more than the first, the cost of 2.4 sigma."""
INLIER_SIGMA2 = 6.25
"""A beam within 2.5 sigma of the map is an inlier."""
ALONG_SHARE = 0.1
"""Share of the squared distance along a line, beyond a cell, that counts in the score: the normal equations take lines
as endless."""


class Sums(NamedTuple):
    """Normal equations over the beams, ``H step = b`` with ``step = (dx, dy, dtheta)`` in the map frame, and the fit.

    ``xx .. tt`` are the upper triangle of ``H`` (1/m^2, 1/(m rad), 1/rad^2), ``bx, by, bt`` are ``b``, ``score`` is the
    sum of log-likelihoods relative to a perfect fit, ``inliers`` and ``conflicts`` are numbers of beams.
    """

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


class Weighting(NamedTuple):
    """How one iteration looks for surfaces and weighs their distances."""

    radius: int
    """Cells around a beam's end in which a surface is looked for where there is none next to it."""
    scale2: float
    """Square of the scale of the robust loss (Geman-McClure), m^2: a beam this far off has a quarter of its weight."""
    weight: float
    """1 / sigma^2, 1/m^2, of a beam that fits."""
    corridor: bool
    """Whether beams hardly hold the pose along one direction, so that slanted normals are corrected (``SLANT_RAD``)."""
    along_x: float
    along_y: float
    """Unit vector along the corridor, map frame."""


@njit(cache=True, nogil=True)
def sum_beams(
    tiles: Tiles, points: NDArray[np.float64], x: float, y: float, theta: float, weighting: Weighting
) -> Sums:  # pragma: no cover - compiled
    """Return the normal equations of ``points (N, 5)`` at a pose in the map: metres, radians."""
    resolution_m, inv = tiles.resolution_m, 1.0 / tiles.resolution_m
    hxx = hxy = hxt = hyy = hyt = htt = bx = by = bt = 0.0
    score, inliers, conflicts = 0.0, 0.0, 0.0
    c, s = math.cos(theta), math.sin(theta)
    for i in range(points.shape[0]):
        rx, ry = c * points[i, 0] - s * points[i, 1], s * points[i, 0] + c * points[i, 1]
        nx, ny = c * points[i, 2] - s * points[i, 3], s * points[i, 2] + c * points[i, 3]
        quality = points[i, 4]
        surface = _surface(tiles, (x + rx) * inv, (y + ry) * inv, nx, ny, quality, weighting.radius)
        if surface.word == 0:
            conflicts += 1.0 if surface.visits > 0 else 0.0
            score -= CONFLICT_COST if surface.visits > 0 else UNKNOWN_COST
            continue
        dx, dy = surface.dx * resolution_m, surface.dy * resolution_m
        line, mx, my = _normal(surface.word, nx, ny, quality, weighting)
        if line:
            r = mx * dx + my * dy  # map minus scan along the normal
            r2 = r * r
            w = _believed(r2, weighting)
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
            along2 = surface.distance2 * resolution_m * resolution_m - r2
            r2 += ALONG_SHARE * max(along2 - resolution_m * resolution_m, 0.0)
        else:
            r2 = dx * dx + dy * dy
            w = _believed(r2, weighting) * POINT_WEIGHT
            hxx += w
            hyy += w
            hxt += -w * ry
            hyt += w * rx
            htt += w * (rx * rx + ry * ry)
            bx += w * dx
            by += w * dy
            bt += w * (-ry * dx + rx * dy)
        score -= min(0.5 * r2 * weighting.weight, CONFLICT_COST)
        if r2 * weighting.weight < INLIER_SIGMA2:
            inliers += 1.0
    return Sums(hxx, hxy, hxt, hyy, hyt, htt, bx, by, bt, score, inliers, conflicts)


@njit(cache=True, nogil=True)
def _believed(r2: float, weighting: Weighting) -> float:  # pragma: no cover - compiled
    """Return the weight (1/m^2) of a beam whose squared distance is ``r2`` (m^2): Geman and McClure's loss."""
    w = weighting.scale2 / (weighting.scale2 + r2)
    return w * w * weighting.weight


@njit(cache=True, nogil=True)
def _surface(
    tiles: Tiles, x: float, y: float, nx: float, ny: float, quality: float, radius: int
) -> Surface:  # pragma: no cover - compiled
    """Return the surface next to a beam's end ``(x, y)`` (cells), or else the nearest at most ``radius`` cells away."""
    near = nearest(tiles, x, y, nx, ny, quality, 1)
    if near.word != 0:
        return near
    wide = nearest(tiles, x, y, nx, ny, quality, radius)
    if wide.word == 0 or wide.distance2 > FAR_CELLS2:
        return near
    return wide


@njit(cache=True, nogil=True)
def _normal(
    word: Any, nx: float, ny: float, quality: float, weighting: Weighting
) -> tuple[bool, float, float]:  # pragma: no cover - compiled
    """Return whether a surface has a unit normal, by its cell's word or the beam's own ``(nx, ny)``, and which."""
    if (word >> 31) & 1 > 0:
        k = (word >> 23) & 0xFF
        mx, my = COS[k], SIN[k]
        if quality > NORMAL_QUALITY:
            # Where beams are sparse the mean of the map's normal and the beam's own is better than either.
            mx, my = mx + nx, my + ny
            norm = 1.0 / math.sqrt(mx * mx + my * my)
            mx *= norm
            my *= norm
    elif quality > NORMAL_QUALITY:
        mx, my = nx, ny
    else:
        return False, 0.0, 0.0
    if weighting.corridor:
        slant = mx * weighting.along_x + my * weighting.along_y
        if abs(slant) < SLANT_RAD:
            mx, my = mx - slant * weighting.along_x, my - slant * weighting.along_y
            norm = 1.0 / math.sqrt(mx * mx + my * my)
            mx *= norm
            my *= norm
    return True, mx, my
