"""From ranges to points with surface normals: what the matcher and the maps work on."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.matching.axes import eigenvalues, least_axis

POINT_COLUMNS = 5
"""A point is (x, y, nx, ny, q): position and unit normal towards the laser in the base frame, metres; q in [0, 1] says
how line-like its surroundings are (0 = no normal), or is ``UNSURE`` where there may be no object at all."""
NORMAL_REACH_M, REACH_SHARE2 = 0.22, 0.0016
"""Neighbours within this distance shape a point's normal, or within 4 % of its range, whose square the second is."""
GAP_M, GAP_SHARE = 0.10, 0.05
"""Neighbours farther apart than this and this share of their range lie on different objects."""
ROUND = 0.12
"""A point has no normal where the variance across its surroundings is at least this share of that along them."""
GRAZING = 0.03
"""Sine of the angle between beam and surface below which a surface may be mixed pixels behind an edge instead."""
UNSURE = -1.0
"""Quality of a point that is drawn into the map but not matched."""
LONE_QUALITY = 0.5
"""Quality of a point without close neighbours whose normal is from those farther off."""
LINE_M, LINE_SHARE = 0.03, 0.003
"""Three lone points are in line within this distance, and this share of their range."""
LONE_REACH = 0.5
"""Three lone points lie at most this share of their range apart."""
WIDER = 1.25
"""Where too many points are left, the next try spaces them wider by this factor."""


@njit(cache=True, nogil=True)
def _lone(points: NDArray[np.float64], i: int, n: int) -> float:  # pragma: no cover - compiled
    """Give a point without close neighbours its normal, if it is in line with the next ones, and return its quality.

    Far along a corridor beams strike the walls metres apart, and at the same distance ahead of the robot in every scan.
    Taken for small objects such points would hold the matched pose where it is.
    """
    for k in range(3):
        a, b, c = i - 1, i, i + 1
        if k == 1:
            a, b, c = i - 2, i - 1, i
        elif k == 2:
            a, b, c = i, i + 1, i + 2
        if a < 0 or c >= n:
            continue
        x, y = points[c, 0] - points[a, 0], points[c, 1] - points[a, 1]
        length = math.hypot(x, y)
        r = math.hypot(points[i, 0], points[i, 1])
        if length < 1e-6 or length > LONE_REACH * r:
            continue
        off = abs(x * (points[b, 1] - points[a, 1]) - y * (points[b, 0] - points[a, 0])) / length
        if off > LINE_M + LINE_SHARE * r:
            continue
        nx, ny = -y / length, x / length
        toward = -(nx * points[i, 0] + ny * points[i, 1])
        if toward < 0.0:
            nx, ny, toward = -nx, -ny, -toward
        if toward < GRAZING * r:
            return UNSURE
        points[i, 2] = nx
        points[i, 3] = ny
        return LONE_QUALITY
    return 0.0


@njit(cache=True, nogil=True)
def _surroundings(
    points: NDArray[np.float64], i: int, n: int
) -> tuple[float, float, float, float]:  # pragma: no cover - compiled
    """Return how many points make up a point's surroundings, itself included, and their covariance xx, xy, yy (m^2).

    They are its neighbours along the beams up to the first gap or the reach of a normal, and one beyond it where
    none is nearer.
    """
    x, y = points[i, 0], points[i, 1]
    r = math.hypot(x, y)
    gap = GAP_M + GAP_SHARE * r
    reach2 = max(NORMAL_REACH_M * NORMAL_REACH_M, REACH_SHARE2 * r * r)
    count, sx, sy, sxx, sxy, syy = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for step in (-1, 1):
        j = i + step
        px, py = x, y
        while 0 <= j < n:
            dx, dy = points[j, 0] - x, points[j, 1] - y
            gx, gy = points[j, 0] - px, points[j, 1] - py
            d2 = dx * dx + dy * dy
            first = j == i + step
            if gx * gx + gy * gy > gap * gap or (d2 > reach2 and not first):
                break
            count += 1.0
            sx += dx
            sy += dy
            sxx += dx * dx
            sxy += dx * dy
            syy += dy * dy
            px, py = points[j, 0], points[j, 1]
            if d2 > reach2:
                break
            j += step
    mx, my = sx / count, sy / count
    return count, sxx / count - mx * mx, sxy / count - mx * my, syy / count - my * my


@njit(cache=True, nogil=True)
def line_quality(xx: float, xy: float, yy: float) -> float:  # pragma: no cover - compiled
    """Return how line-like points with this covariance (m^2) are: 1 of a line, at most 0 where they have no normal."""
    small, large = eigenvalues(xx, xy, yy)
    return 1.0 - max(small, 0.0) / (ROUND * large + 1e-9)


@njit(cache=True, nogil=True)
def _find_normal(points: NDArray[np.float64], i: int, n: int) -> None:  # pragma: no cover - compiled
    """Write a point's normal and its quality, from the points around it."""
    x, y = points[i, 0], points[i, 1]
    points[i, 2] = points[i, 3] = 0.0
    count, cxx, cxy, cyy = _surroundings(points, i, n)
    if count < 3.0:
        points[i, 4] = _lone(points, i, n)
        return
    nx, ny = least_axis(cxx, cxy, cyy)
    toward = -(nx * x + ny * y)
    if toward < 0.0:
        nx, ny, toward = -nx, -ny, -toward
    quality = line_quality(cxx, cxy, cyy)
    if toward < GRAZING * math.hypot(x, y):
        points[i, 4] = UNSURE
    elif quality <= 0.0:
        points[i, 4] = 0.0
    else:
        points[i, 2], points[i, 3], points[i, 4] = nx, ny, quality


@njit(cache=True, nogil=True)
def scan_points(
    ranges_m: NDArray[np.float32],
    cos: NDArray[np.float64],
    sin: NDArray[np.float64],
    T_base_laser: NDArray[np.float64],
    usable_range_m: float,
    points: NDArray[np.float64],
) -> int:  # pragma: no cover - compiled
    """Write the usable returns as rows of ``points (B, 5)``, base frame, in beam order, and return how many.

    ``cos, sin (B,)`` are of the beam directions in the laser frame; ``T_base_laser (3,)``.
    """
    n = 0
    for i in range(ranges_m.size):
        r = ranges_m[i]
        if not (r > 0.0 and r <= usable_range_m):
            continue
        points[n, 0] = r * cos[i]
        points[n, 1] = r * sin[i]
        n += 1
    for i in range(n):
        _find_normal(points, i, n)
    ct, st = math.cos(T_base_laser[2]), math.sin(T_base_laser[2])
    for i in range(n):
        x, y, nx, ny = points[i, 0], points[i, 1], points[i, 2], points[i, 3]
        points[i, 0] = T_base_laser[0] + ct * x - st * y
        points[i, 1] = T_base_laser[1] + st * x + ct * y
        points[i, 2] = ct * nx - st * ny
        points[i, 3] = st * nx + ct * ny
    return n


@njit(cache=True, nogil=True)
def spaced(
    points: NDArray[np.float64],
    origin: NDArray[np.float64],
    spacing_m: float,
    most: int,
    out: NDArray[np.float64],
) -> int:  # pragma: no cover - compiled
    """Copy at most ``most`` of ``points (N, 5)`` to ``out``, ``spacing_m`` apart for the laser; return how many.

    ``origin (>= 2,)`` is the laser's place, in the frame of the points. ``UNSURE`` points are left out. The distance is
    measured across the beams, where there is no noise: picking points by how far they lie from each other prefers those
    measured too long where ranges grow from beam to beam, and too short where they fall, which turned the robot by a
    degree every ten metres.
    """
    n = points.shape[0]
    while True:
        kept = 0
        arc = spacing_m
        lx = ly = 0.0
        for i in range(n):
            x, y = points[i, 0] - origin[0], points[i, 1] - origin[1]
            if i > 0:
                arc += abs(lx * y - ly * x) / max(math.sqrt(lx * lx + ly * ly), 1e-9)
            lx, ly = x, y
            if arc < spacing_m or points[i, 4] < 0.0:
                continue
            arc = 0.0
            if kept < most:
                for k in range(POINT_COLUMNS):
                    out[kept, k] = points[i, k]
            kept += 1
        if kept <= most:
            return kept
        spacing_m *= WIDER
