"""From ranges to points with surface normals: what the matcher and the maps work on."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

# A point is (x, y, nx, ny, q): position and unit normal towards the laser in the base frame, metres;
# q in [0, 1] tells how line-like its surroundings are (0 = no normal).
POINT_COLUMNS = 5
NORMAL_REACH_M = 0.22
"""Neighbours within this distance shape a point's normal, metres."""


@njit(cache=True, nogil=True)
def scan_points(
    ranges_m: NDArray[np.float32],
    cos: NDArray[np.float64],
    sin: NDArray[np.float64],
    T_base_laser: NDArray[np.float64],
    usable_range_m: float,
    points: NDArray[np.float64],
) -> int:  # pragma: no cover - compiled
    """Write the usable returns as rows of ``points (B, 5)``, in beam order, and return how many.

    ``cos, sin (B,)`` are of the beam directions in the laser frame.
    """
    n = 0
    for i in range(ranges_m.size):
        r = ranges_m[i]
        if not (r > 0.0 and r <= usable_range_m):
            continue
        points[n, 0] = r * cos[i]
        points[n, 1] = r * sin[i]
        points[n, 4] = i
        n += 1
    reach2 = NORMAL_REACH_M * NORMAL_REACH_M
    ct, st = math.cos(T_base_laser[2]), math.sin(T_base_laser[2])
    for i in range(n):
        x, y = points[i, 0], points[i, 1]
        r = math.hypot(x, y)
        gap = 0.10 + 0.05 * r
        reach_here = max(reach2, 0.0016 * r * r)
        count, sx, sy, sxx, sxy, syy = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for step in (-1, 1):
            j = i + step
            px, py = x, y
            while 0 <= j < n:
                dx, dy = points[j, 0] - x, points[j, 1] - y
                gx, gy = points[j, 0] - px, points[j, 1] - py
                d2 = dx * dx + dy * dy
                first = j == i + step
                if gx * gx + gy * gy > gap * gap or (d2 > reach_here and not first):
                    break
                count += 1.0
                sx += dx
                sy += dy
                sxx += dx * dx
                sxy += dx * dy
                syy += dy * dy
                px, py = points[j, 0], points[j, 1]
                if d2 > reach_here:
                    break
                j += step
        points[i, 2] = 0.0
        points[i, 3] = 0.0
        if count < 3.0:
            points[i, 4] = 0.0
            continue
        mx, my = sx / count, sy / count
        cxx, cxy, cyy = sxx / count - mx * mx, sxy / count - mx * my, syy / count - my * my
        mean, half = 0.5 * (cxx + cyy), math.sqrt(0.25 * (cxx - cyy) ** 2 + cxy * cxy)
        small, large = max(mean - half, 0.0), mean + half
        # The normal is the direction of least spread.
        angle = 0.5 * math.atan2(2.0 * cxy, cxx - cyy) + 0.5 * math.pi
        nx, ny = math.cos(angle), math.sin(angle)
        toward = -(nx * x + ny * y)
        if toward < 0.0:
            nx, ny, toward = -nx, -ny, -toward
        quality = 1.0 - small / (0.12 * large + 1e-9)
        if quality <= 0.0 or toward < 0.03 * r:
            points[i, 4] = 0.0
            continue
        points[i, 2] = nx
        points[i, 3] = ny
        points[i, 4] = min(quality, 1.0)
    for i in range(n):
        x, y, nx, ny = points[i, 0], points[i, 1], points[i, 2], points[i, 3]
        points[i, 0] = T_base_laser[0] + ct * x - st * y
        points[i, 1] = T_base_laser[1] + st * x + ct * y
        points[i, 2] = ct * nx - st * ny
        points[i, 3] = st * nx + ct * ny
    return n


@njit(cache=True, nogil=True)
def spaced(
    points: NDArray[np.float64], spacing_m: float, most: int, out: NDArray[np.float64]
) -> int:  # pragma: no cover
    """Copy points ``spacing_m`` or more from the one kept before, wider if more than ``most``; return how many."""
    while True:
        kept = 0
        lx = ly = 1e30
        for i in range(points.shape[0]):
            dx, dy = points[i, 0] - lx, points[i, 1] - ly
            if dx * dx + dy * dy < spacing_m * spacing_m:
                continue
            lx, ly = points[i, 0], points[i, 1]
            if kept < most:
                for k in range(5):
                    out[kept, k] = points[i, k]
            kept += 1
        if kept <= most:
            return kept
        spacing_m *= 1.25
