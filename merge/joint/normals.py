"""The points of a published scan with the normals of the walls that they lie on."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.hits.cells import NORMAL_QUALITY
from mrslam.spatial.matching.scan_points import POINT_COLUMNS, scan_points


def with_normals(points: NDArray[np.float32], origin: NDArray[np.float32]) -> NDArray[np.float64]:
    """Return points ``(n, 2)`` with normals: up to n rows (x, y, nx, ny, quality) as :func:`scan_points` makes them.

    ``points`` and the laser's position ``origin (2,)`` are in the base frame, metres; normals point toward the laser.
    """
    laser = origin.astype(np.float64)
    away = points.astype(np.float64) - laser
    ranges = np.hypot(away[:, 0], away[:, 1])
    cos, sin = (away / np.maximum(ranges, 1e-9)[:, None]).T
    out = np.empty((len(points), POINT_COLUMNS))
    T_base_laser = np.array([laser[0], laser[1], 0.0])
    count = scan_points(
        ranges.astype(np.float32), np.ascontiguousarray(cos), np.ascontiguousarray(sin), T_base_laser, np.inf, out
    )
    out = out[:count]
    is_bare = (out[:, 4] >= 0.0) & (out[:, 4] <= NORMAL_QUALITY)
    out[is_bare, 2:4] = (laser - out[is_bare, :2]) / np.maximum(ranges[is_bare], 1e-9)[:, None]
    out[is_bare, 4] = 0.0
    return out
