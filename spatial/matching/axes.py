"""Principal axes of a symmetric 2 x 2 matrix: of points' covariance, or of what beams say about a position."""

from __future__ import annotations

import math

from numba import njit


@njit(cache=True, nogil=True)
def eigenvalues(xx: float, xy: float, yy: float) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the smaller and the larger eigenvalue; rounding may leave the smaller one just below 0."""
    middle, half = 0.5 * (xx + yy), math.sqrt(0.25 * (xx - yy) ** 2 + xy * xy)
    return middle - half, middle + half


@njit(cache=True, nogil=True)
def main_axis(xx: float, xy: float, yy: float) -> float:  # pragma: no cover - compiled
    """Return the angle of the larger eigenvalue's axis, radians; the other axis is at right angles to it."""
    return 0.5 * math.atan2(2.0 * xy, xx - yy)


@njit(cache=True, nogil=True)
def least_axis(xx: float, xy: float, yy: float) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return a unit vector along the smaller eigenvalue's axis: a surface's normal, or the direction seen least."""
    angle = main_axis(xx, xy, yy) + 0.5 * math.pi
    return math.cos(angle), math.sin(angle)
