"""Points of straight walls, for tests."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.filter.straight_walls import stretches

ORIGIN = np.zeros(2)


def line(
    from_xy: tuple[float, float], direction_deg: float, length_m: float, step_m: float = 0.05
) -> NDArray[np.float64]:
    """Points ``(N, 5)`` of a straight wall."""
    way = np.arange(0.0, length_m, step_m)
    points = np.zeros((way.size, 5))
    points[:, 0] = from_xy[0] + way * math.cos(math.radians(direction_deg))
    points[:, 1] = from_xy[1] + way * math.sin(math.radians(direction_deg))
    return points


def walls_of(points: NDArray[np.float64]) -> NDArray[np.float64]:
    """Stretches ``(M, 3)`` of wall in a scan."""
    out = np.zeros((64, 3))
    return out[: stretches(points, ORIGIN, out)]
