"""How many distinct walls a fit rests on: two fix a transform, each further one is a coincidence where it is false."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]
DIRECTIONS = 90
"""Directions in a full turn that walls are told apart by: bins of 4 degrees."""
SPREAD = 3
"""Bins to either side of its normal that a point votes for: 12 degrees, more than normals of rough walls are off."""
ON_LINE = 0.8
"""Least cosine between a wall's direction and the normals of its points: 37 degrees."""


@njit(cache=True, nogil=True)
def distinct_walls(
    points: F64, normals: F64, least: float, apart_m: float, most: int
) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return how many points lie on each of the straight, directed walls, largest first; at most ``most`` walls.

    Greedy Hough: the line with most votes is taken and its points removed, until one holds fewer than ``least``.
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
        vote(votes, points[i, 0] - cx, points[i, 1] - cy, normals[i, 0], normals[i, 1], cell, 1)
    for wall in range(most):
        best, at, shift = strongest_line(votes)
        if best < least:
            return sizes[:wall]
        sizes[wall] = best
        nx, ny = math.cos(at * turn), math.sin(at * turn)
        line = (shift + 1 - half) * cell
        for i in range(n):
            x, y = points[i, 0] - cx, points[i, 1] - cy
            if (
                not live[i]
                or normals[i, 0] * nx + normals[i, 1] * ny < ON_LINE
                or abs(x * nx + y * ny - line) > apart_m
            ):
                continue
            live[i] = False
            vote(votes, x, y, normals[i, 0], normals[i, 1], cell, -1)
    return sizes


@njit(cache=True, nogil=True)
def vote(
    votes: NDArray[np.int32], x: float, y: float, nx: float, ny: float, cell: float, weight: int
) -> None:  # pragma: no cover - compiled
    """Add a wall point's votes ``(direction, distance)``: the lines through it that face about as it does."""
    turn = 2.0 * math.pi / votes.shape[0]
    half = votes.shape[1] // 2
    middle = int(round(math.atan2(ny, nx) / turn))
    for k in range(middle - SPREAD, middle + SPREAD + 1):
        rho = x * math.cos(k * turn) + y * math.sin(k * turn)
        votes[k % votes.shape[0], int(math.floor(rho / cell)) + half] += weight


@njit(cache=True, nogil=True)
def strongest_line(votes: NDArray[np.int32]) -> tuple[int, int, int]:  # pragma: no cover - compiled
    """Return votes, direction and distance (index) of the two neighbouring distances with most votes."""
    best, at, shift = 0, 0, 0
    for k in range(votes.shape[0]):
        for j in range(votes.shape[1] - 1):
            v = votes[k, j] + votes[k, j + 1]
            if v > best:
                best, at, shift = v, k, j
    return best, at, shift
