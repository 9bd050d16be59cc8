"""Straight stretches of wall in one scan, and the direction that most of them have."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.matching.axes import eigenvalues, main_axis

LEAST_M, LEAST_POINTS = 0.8, 8
"""A stretch of wall is at least this long (m), and has at least this number of points: less is furniture."""
OFF_M, OFF_SHARE = 0.05, 0.003
"""Its points lie within this (m) of a line, and this share of their range more: a cell, and a laser's noise."""
GAP_M, GAP_SHARE = 0.25, 0.05
"""Two neighbours of a stretch are at most this far apart (m), and this share of their range more."""
NOISE_M = 0.01
"""Range noise of the points of a wall is at least this, metres."""
SPLITS_MOST = 64
"""Pieces of one scan that wait to be looked at; more are passed over."""
STRETCHES_MOST, STRETCH_COLUMNS = 64, 3
"""Stretches of one scan that are kept; columns (direction, variance, length) of each."""
ALIKE_RAD = math.radians(1.5)
"""Stretches of one direction differ by no more."""
WALLS_LEAST_M, WALLS_SHARE = 3.0, 0.5
"""A scan shows a direction if its walls are this long (m) in all, and are this share of all walls in it."""
PARALLEL_RAD = math.radians(0.3)
"""Walls of one building are parallel within this (1 sigma)."""
RIGHT = 0.5 * math.pi
"""A right angle, radians."""


def folded(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return angles modulo a right angle, in -45..45 degrees (radians in and out)."""
    return angle - RIGHT * np.round(angle / RIGHT)


@njit(cache=True, nogil=True)
def stretches(
    points: NDArray[np.float64], origin: NDArray[np.float64], out: NDArray[np.float64]
) -> int:  # pragma: no cover - compiled
    """Write ``(direction, variance, length)`` of each straight stretch of wall into ``out (M, 3)``; return how many.

    ``points (N, >= 2)`` in the order of the beams and ``origin (2,)``, where the laser is, metres; directions in
    radians modulo half a turn, and their variance from how the points scatter about the line that fits them best.
    Stretches are what is left where the points are cut at gaps and, again and again, where they are farthest off their
    chord.
    """
    n = points.shape[0]
    stack = np.empty((SPLITS_MOST, 2), dtype=np.int64)
    found = 0
    begin = 0
    for end in range(1, n + 1):
        if end < n:
            r = math.hypot(points[end, 0] - origin[0], points[end, 1] - origin[1])
            gap = GAP_M + GAP_SHARE * r
            if math.hypot(points[end, 0] - points[end - 1, 0], points[end, 1] - points[end - 1, 1]) <= gap:
                continue
        stack[0, 0], stack[0, 1] = begin, end
        begin = end
        depth = 1
        while depth > 0:
            depth -= 1
            a, b = stack[depth, 0], stack[depth, 1]
            if b - a < LEAST_POINTS:
                continue
            length = math.hypot(points[b - 1, 0] - points[a, 0], points[b - 1, 1] - points[a, 1])
            if length < LEAST_M:
                continue
            where = _corner(points, a, b, origin)
            if where >= 0:
                if depth + 2 <= SPLITS_MOST:
                    stack[depth, 0], stack[depth, 1] = a, where
                    stack[depth + 1, 0], stack[depth + 1, 1] = where, b
                    depth += 2
                continue
            if found < out.shape[0]:
                out[found, 0], out[found, 1] = _line(points, a, b)
                out[found, 2] = length
                found += 1
    return found


@njit(cache=True, nogil=True)
def _corner(
    points: NDArray[np.float64], a: int, b: int, origin: NDArray[np.float64]
) -> int:  # pragma: no cover - compiled
    """Return which of the points ``a .. b - 1`` is farthest off their chord, -1 where all lie on it."""
    ux, uy = points[b - 1, 0] - points[a, 0], points[b - 1, 1] - points[a, 1]
    length = math.hypot(ux, uy)
    ux, uy = ux / length, uy / length
    worst, where = 0.0, a
    for i in range(a + 1, b - 1):
        off = abs(-uy * (points[i, 0] - points[a, 0]) + ux * (points[i, 1] - points[a, 1]))
        if off > worst:
            worst, where = off, i
    r = math.hypot(points[where, 0] - origin[0], points[where, 1] - origin[1])
    return where if worst > OFF_M + OFF_SHARE * r else -1


@njit(cache=True, nogil=True)
def _line(points: NDArray[np.float64], a: int, b: int) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the direction of the line that fits points ``a .. b - 1`` best, radians, and its variance."""
    mx = my = 0.0
    for i in range(a, b):
        mx += points[i, 0]
        my += points[i, 1]
    mx, my = mx / (b - a), my / (b - a)
    cxx = cxy = cyy = 0.0
    for i in range(a, b):
        x, y = points[i, 0] - mx, points[i, 1] - my
        cxx += x * x
        cxy += x * y
        cyy += y * y
    small, large = eigenvalues(cxx, cxy, cyy)
    return main_axis(cxx, cxy, cyy), max(small / (b - a), NOISE_M * NOISE_M) / large


def main_direction(walls: NDArray[np.float64]) -> tuple[float, float] | None:
    """Return the direction of most of a scan's walls, modulo a right angle, and its variance; None where there is none.

    ``walls (M, 3)`` as :func:`stretches` writes them; radians.
    """
    if not walls.size:
        return None
    direction, variance, length = walls.T
    alike = np.abs(folded(direction[:, None] - direction)) < ALIKE_RAD
    alike_m = alike @ length
    first = int(np.argmax(alike_m))
    if alike_m[first] < max(WALLS_LEAST_M, WALLS_SHARE * length.sum()):
        return None
    weights = alike[first] / (variance + PARALLEL_RAD**2)
    mean = direction[first] + weights @ folded(direction - direction[first]) / weights.sum()
    return float(mean), float(1.0 / weights.sum())
