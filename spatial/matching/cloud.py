"""Points of several scans as if one scan had seen them: normals from all of them, in the order of their bearings."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.matching.axes import eigenvalues, least_axis
from mrslam.spatial.matching.scan_points import NORMAL_REACH_M, POINT_COLUMNS, REACH_SHARE2, line_quality

NEIGHBOURS_LEAST = 4
"""Points within reach, the point itself included, that make a normal: with fewer it keeps the one of its own scan."""
LONG_LEAST = 0.25
"""They must spread along the surface by this share of the reach: noise of one spot has no direction."""


def transformed(points: NDArray[np.float64], T_a_b: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return points ``(N, 5)`` with normals, known in frame b, in frame a; ``T_a_b (3,)``, metres and radians."""
    x, y, nx, ny, quality = points.T
    c, s = math.cos(T_a_b[2]), math.sin(T_a_b[2])
    place = [T_a_b[0] + c * x - s * y, T_a_b[1] + s * x + c * y]
    return np.stack([*place, c * nx - s * ny, s * nx + c * ny, quality], axis=1)


def joined(parts: list[NDArray[np.float64]], origin: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the points of several scans ``(n, 5)``, in one frame, as one ``(N, 5)`` seen from ``origin (2,)``."""
    points = np.concatenate(parts)
    order = np.argsort(np.arctan2(points[:, 1] - origin[1], points[:, 0] - origin[0]), kind="stable")
    points = np.ascontiguousarray(points[order])
    out = points.copy()
    find_normals(points, origin, out)
    return out


@njit(cache=True, nogil=True)
def find_normals(
    points: NDArray[np.float64], origin: NDArray[np.float64], out: NDArray[np.float64]
) -> None:  # pragma: no cover - compiled
    """Write normals and qualities of ``points (N, 5)``, those around each taken together, to ``out (N, 5)``.

    They look towards ``origin (2,)``. Points that have too few others around them stay as they are.
    """
    n = points.shape[0]
    for i in range(n):
        x, y = points[i, 0], points[i, 1]
        ox, oy = x - origin[0], y - origin[1]
        reach2 = max(NORMAL_REACH_M * NORMAL_REACH_M, REACH_SHARE2 * (ox * ox + oy * oy))
        count, sx, sy, sxx, sxy, syy = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for j in range(n):
            dx, dy = points[j, 0] - x, points[j, 1] - y
            if dx * dx + dy * dy > reach2:
                continue
            count += 1.0
            sx += dx
            sy += dy
            sxx += dx * dx
            sxy += dx * dy
            syy += dy * dy
        if count < NEIGHBOURS_LEAST:
            continue
        mx, my = sx / count, sy / count
        cxx, cxy, cyy = sxx / count - mx * mx, sxy / count - mx * my, syy / count - my * my
        quality = line_quality(cxx, cxy, cyy)
        if quality <= 0.0 or eigenvalues(cxx, cxy, cyy)[1] < LONG_LEAST * LONG_LEAST * reach2:
            continue
        nx, ny = least_axis(cxx, cxy, cyy)
        if nx * ox + ny * oy > 0.0:
            nx, ny = -nx, -ny
        out[i, 2], out[i, 3], out[i, POINT_COLUMNS - 1] = nx, ny, quality
