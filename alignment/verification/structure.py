"""How many distinct walls a fit rests on: two fix a transform, each further one is a coincidence where it is false."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]
DIRECTIONS = 90
"""Directions in a full turn that walls are told apart by."""


@njit(cache=True, nogil=True)
def distinct_walls(
    points: F64, normals: F64, least: float, apart_m: float, most: int
) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return how many points lie on each of the straight, directed walls, largest first; at most ``most`` walls.

    Greedy Hough: the line with most points is taken and its points removed, until one holds fewer than ``least``.
    ``apart_m``: two parallel walls nearer than this are one.
    """
    n = points.shape[0]
    sizes = np.zeros(most, dtype=np.int64)
    if n == 0:
        return sizes[:0]
    cx, cy = points[:, 0].mean(), points[:, 1].mean()
    reach = 0.0
    for i in range(n):
        reach = max(reach, math.hypot(points[i, 0] - cx, points[i, 1] - cy))
    cell = 0.5 * apart_m
    half = int(reach / cell) + 2
    turn = 2.0 * math.pi / DIRECTIONS
    votes = np.zeros((DIRECTIONS, 2 * half + 1), dtype=np.int32)
    live = np.ones(n, dtype=np.bool_)
    for i in range(n):
        if normals[i, 0] == 0.0 and normals[i, 1] == 0.0:
            live[i] = False
            continue
        middle = int(round(math.atan2(normals[i, 1], normals[i, 0]) / turn))
        for k in range(middle - 3, middle + 4):
            rho = (points[i, 0] - cx) * math.cos(k * turn) + (points[i, 1] - cy) * math.sin(k * turn)
            votes[k % DIRECTIONS, int(math.floor(rho / cell)) + half] += 1
    for wall in range(most):
        best, at, shift = 0, 0, 0
        for k in range(DIRECTIONS):
            for j in range(2 * half):
                v = votes[k, j] + votes[k, j + 1]
                if v > best:
                    best, at, shift = v, k, j
        if best < least:
            return sizes[:wall]
        sizes[wall] = best
        nx, ny = math.cos(at * turn), math.sin(at * turn)
        line = (shift + 1 - half) * cell
        for i in range(n):
            if not live[i] or normals[i, 0] * nx + normals[i, 1] * ny < 0.8:
                continue
            if abs((points[i, 0] - cx) * nx + (points[i, 1] - cy) * ny - line) > apart_m:
                continue
            live[i] = False
            middle = int(round(math.atan2(normals[i, 1], normals[i, 0]) / turn))
            for k in range(middle - 3, middle + 4):
                rho = (points[i, 0] - cx) * math.cos(k * turn) + (points[i, 1] - cy) * math.sin(k * turn)
                votes[k % DIRECTIONS, int(math.floor(rho / cell)) + half] -= 1
    return sizes
