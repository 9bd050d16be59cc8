"""Scan matching: Gauss-Newton on point-to-line distances to the mean hit points of the cells around each beam's end."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.rbpf.match.nearest import nearest

# Layout of the result row written by `match`.
X, Y, THETA, SCORE, INLIERS, CONFLICTS, KNOWN = 0, 1, 2, 3, 4, 5, 6
INFO = 7  # 7..12: upper triangle of the information matrix: xx xy xt yy yt tt
BLIND = 13  # share of the direction seen least that the match says nothing about, and that direction's unit vector
RESULT_SIZE = 16

POINT_WEIGHT = 0.2
"""Weight of a correspondence without a normal beside one with."""
CORRIDOR = 0.05
"""Where the beams tell less than this share along one direction of that across, they are looked at closer."""
SLANT = 0.25
"""Normals that look along a corridor by less than this (radians) are those of its walls, with their errors."""
CREDIBLE = 1.0
"""Beams that look along a corridor and are worth less than this many, all together, may be chance."""


@njit(cache=True, nogil=True)
def match(
    pool: NDArray[np.uint32],
    table: NDArray[np.int32],
    row0: int,
    col0: int,
    resolution_m: float,
    points: NDArray[np.float64],
    start: NDArray[np.float64],
    prior: NDArray[np.float64],
    prior_info: NDArray[np.float64],
    sigma_m: float,
    iterations: int,
    cos_table: NDArray[np.float64],
    sin_table: NDArray[np.float64],
    out: NDArray[np.float64],
) -> None:  # pragma: no cover - compiled
    """Write the pose that fits ``points (N, 5)`` best, with score and information, into ``out (13,)``.

    Minimises the robust sum of squared point-to-line distances over ``sigma_m``, plus the prior
    ``(x - prior)^T prior_info (x - prior)``. ``SCORE`` is the mean log-likelihood of a beam relative to a perfect fit;
    ``INLIERS``, ``CONFLICTS`` and ``KNOWN`` are shares of beams: within 2.5 sigma of the map, ending in known free
    space, either. The information is of the matching alone, without the prior. Errors of normals feign knowledge along
    a corridor; it is taken out, and if hardly anything is left, only the prior counts there (solution remapping, Zhang,
    Kaess and Singh 2016).
    """
    inv = 1.0 / resolution_m
    n = points.shape[0]
    x, y, theta = start[0], start[1], start[2]
    weight0 = 1.0 / (sigma_m * sigma_m)
    hxx = hxy = hxt = hyy = hyt = htt = 0.0
    it = 0
    settled = False
    blind, ex_, ey_ = 0.0, 1.0, 0.0
    corridor = False
    while True:
        final = settled or it >= iterations
        hxx = hxy = hxt = hyy = hyt = htt = 0.0
        bx = by = bt = 0.0
        score, inliers, conflicts = 0.0, 0.0, 0.0
        c, s = math.cos(theta), math.sin(theta)
        # Wide at first, to draw in what is off; narrow at the end, to leave out what does not belong.
        scale2 = (max(3.0 * sigma_m, 0.12) if it < 2 else 1.5 * sigma_m) ** 2
        for i in range(n):
            rx = c * points[i, 0] - s * points[i, 1]
            ry = s * points[i, 0] + c * points[i, 1]
            quality = points[i, 4]
            nx = c * points[i, 2] - s * points[i, 3]
            ny = s * points[i, 2] + c * points[i, 3]
            px, py = (x + rx) * inv, (y + ry) * inv
            word, dx, dy, d2 = nearest(pool, table, row0, col0, px, py, nx, ny, quality, 1, cos_table, sin_table)
            if word == 0:
                free = dx
                word, dx, dy, d2 = nearest(
                    pool, table, row0, col0, px, py, nx, ny, quality, 3 if it < 2 else 2, cos_table, sin_table
                )
                if word == 0 or d2 > 9.0:
                    if free > 0.0:
                        conflicts += 1.0
                        score -= 3.0
                    else:
                        score -= 1.0
                    continue
            dx *= resolution_m
            dy *= resolution_m
            line = bool((word >> 31) & 1 > 0)
            if line:
                k = (word >> 23) & 0xFF
                mx, my = cos_table[k], sin_table[k]
                if quality > 0.2:
                    # Where beams are sparse the mean point's wall is known better from both sides.
                    mx, my = mx + nx, my + ny
                    norm = 1.0 / math.sqrt(mx * mx + my * my)
                    mx *= norm
                    my *= norm
            elif quality > 0.2:
                mx, my = nx, ny
                line = True
            else:
                mx, my = 0.0, 0.0
            if line:
                if corridor:
                    slant = mx * ex_ + my * ey_
                    if abs(slant) < SLANT:
                        mx, my = mx - slant * ex_, my - slant * ey_
                        norm = 1.0 / math.sqrt(mx * mx + my * my)
                        mx *= norm
                        my *= norm
                r = mx * dx + my * dy  # map minus scan along the normal
                r2 = r * r
                w = scale2 / (scale2 + r2)
                w = w * w * weight0
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
                r2 += 0.1 * max(d2 * resolution_m * resolution_m - r2 - resolution_m * resolution_m, 0.0)
            else:
                r2 = dx * dx + dy * dy
                w = scale2 / (scale2 + r2)
                w = w * w * weight0 * POINT_WEIGHT
                hxx += w
                hyy += w
                hxt += -w * ry
                hyt += w * rx
                htt += w * (rx * rx + ry * ry)
                bx += w * dx
                by += w * dy
                bt += w * (-ry * dx + rx * dy)
            e = 0.5 * r2 * weight0
            score -= min(e, 3.0)
            if r2 * weight0 < 6.25:
                inliers += 1.0
        middle, half = 0.5 * (hxx + hyy), math.hypot(0.5 * (hxx - hyy), hxy)
        blind = 0.0
        if corridor:
            blind = min(max(2.0 - (middle - half) / (CREDIBLE * weight0), 0.0), 1.0)
        corridor = middle - half < CORRIDOR * (middle + half)
        if corridor:
            angle = 0.5 * math.atan2(2.0 * hxy, hxx - hyy) + 0.5 * math.pi
            ex_, ey_ = math.cos(angle), math.sin(angle)
        if blind > 0.0:
            along = blind * (ex_ * bx + ey_ * by)
            bx -= along * ex_
            by -= along * ey_
            # S H S with S = 1 - (1 - sqrt(1 - blind)) e e^T.
            k = 1.0 - math.sqrt(1.0 - blind)
            along = k * (ex_ * hxt + ey_ * hyt)
            hxt -= along * ex_
            hyt -= along * ey_
            along = blind * (middle - half)
            hxx -= along * ex_ * ex_
            hxy -= along * ex_ * ey_
            hyy -= along * ey_ * ey_
        if final:
            out[SCORE] = score / max(n, 1)
            out[INLIERS] = inliers / max(n, 1)
            out[CONFLICTS] = conflicts / max(n, 1)
            out[KNOWN] = (inliers + conflicts) / max(n, 1)
            break
        ex, ey = prior[0] - x, prior[1] - y
        et = prior[2] - theta
        et -= 2.0 * math.pi * math.floor((et + math.pi) / (2.0 * math.pi))
        axx, axy, axt = hxx + prior_info[0, 0] + 1e-3, hxy + prior_info[0, 1], hxt + prior_info[0, 2]
        ayy, ayt, att = hyy + prior_info[1, 1] + 1e-3, hyt + prior_info[1, 2], htt + prior_info[2, 2] + 1e-3
        gx = bx + prior_info[0, 0] * ex + prior_info[0, 1] * ey + prior_info[0, 2] * et
        gy = by + prior_info[0, 1] * ex + prior_info[1, 1] * ey + prior_info[1, 2] * et
        gt = bt + prior_info[0, 2] * ex + prior_info[1, 2] * ey + prior_info[2, 2] * et
        l11 = math.sqrt(axx)
        l21, l31 = axy / l11, axt / l11
        l22 = math.sqrt(max(ayy - l21 * l21, 1e-9))
        l32 = (ayt - l31 * l21) / l22
        l33 = math.sqrt(max(att - l31 * l31 - l32 * l32, 1e-9))
        z1 = gx / l11
        z2 = (gy - l21 * z1) / l22
        z3 = (gt - l31 * z1 - l32 * z2) / l33
        dt = z3 / l33
        dy_ = (z2 - l32 * dt) / l22
        dx_ = (z1 - l21 * dy_ - l31 * dt) / l11
        limit = 0.3
        norm2 = dx_ * dx_ + dy_ * dy_
        if norm2 > limit * limit:
            shrink = limit / math.sqrt(norm2)
            dx_, dy_, dt = dx_ * shrink, dy_ * shrink, dt * shrink
        dt = min(max(dt, -0.2), 0.2)
        x += dx_
        y += dy_
        theta += dt
        settled = it >= 2 and norm2 < 1e-6 and dt * dt < 1e-7
        it += 1
    out[X] = x
    out[Y] = y
    out[THETA] = theta - 2.0 * math.pi * math.floor((theta + math.pi) / (2.0 * math.pi))
    out[INFO] = hxx
    out[INFO + 1] = hxy
    out[INFO + 2] = hxt
    out[INFO + 3] = hyy
    out[INFO + 4] = hyt
    out[INFO + 5] = htt
    out[BLIND] = blind
    out[BLIND + 1] = ex_
    out[BLIND + 2] = ey_
