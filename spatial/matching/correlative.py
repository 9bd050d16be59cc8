"""Correlative search: the best of a lattice of poses, where the prediction is too poor to descend from."""

from __future__ import annotations

import math
from functools import partial
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.nearest import nearest
from mrslam.spatial.runtime.crew import Crew

FAR_COST = 1e-3
"""What a pose at the lattice's corner must be better by, score per beam: so little that it only breaks ties."""


class Lattice(NamedTuple):
    """Poses around a centre that a search tries."""

    half_turn_rad: float
    """To either side of the centre."""
    turn_step_rad: float
    """From one heading to the next."""
    half_shift_m: float
    """To either side, along x and along y of the map."""
    shift_step_m: float
    """From one position to the next."""
    points_most: int
    """Every n-th point of the scan is used, with n such that at least this number is, and less than twice as many."""


class Found(NamedTuple):
    """The best pose of a lattice."""

    pose: NDArray[np.float64]
    """``(3,)``, in the map."""
    score: float
    """Sum over the points used of 1 / (1 + d^2), d in cells, less a little for the distance from the centre."""
    rank: int
    """Place in the order of the search; the lowest wins where scores are equal."""


@njit(cache=True, nogil=True)
def _turn(
    points: NDArray[np.float64],
    stride: int,
    centre: NDArray[np.float64],
    theta: float,
    inv: float,
    out: NDArray[np.float64],
) -> None:  # pragma: no cover - compiled
    """Write every ``stride``-th point as seen from the centre with heading ``theta`` into ``out (n, 5)``, in cells."""
    c, s = math.cos(theta), math.sin(theta)
    for k in range(out.shape[0]):
        i = k * stride
        out[k, 0] = (centre[0] + c * points[i, 0] - s * points[i, 1]) * inv
        out[k, 1] = (centre[1] + s * points[i, 0] + c * points[i, 1]) * inv
        out[k, 2] = c * points[i, 2] - s * points[i, 3]
        out[k, 3] = s * points[i, 2] + c * points[i, 3]
        out[k, 4] = points[i, 4]


@njit(cache=True, nogil=True)
def _score(
    tiles: Tiles, turned: NDArray[np.float64], x: float, y: float, cost: float, best: float
) -> float:  # pragma: no cover - compiled
    """Return the score of points ``(n, 5)`` shifted by ``(x, y)``, all in cells, less ``cost``.

    Where it cannot exceed ``best`` any more it ends early, with any score that does not.
    """
    score, used = -cost, turned.shape[0]
    for k in range(used):
        surface = nearest(tiles, turned[k, 0] + x, turned[k, 1] + y, turned[k, 2], turned[k, 3], turned[k, 4], 1)
        if surface.word != 0:
            score += 1.0 / (1.0 + surface.distance2)
        if score + (used - 1 - k) <= best:
            break
    return score


@njit(cache=True, nogil=True)
def search_turns(
    tiles: Tiles,
    points: NDArray[np.float64],
    centre: NDArray[np.float64],
    lattice: Lattice,
    first: int,
    step: int,
) -> Found:  # pragma: no cover - compiled
    """Return the best pose of every ``step``-th turn of a lattice around ``centre (3,)``, from the ``first`` on.

    ``points (N, 5)``. Of the whole lattice the best is the one with the highest score, and of those the lowest rank.
    """
    half_turn, turn_step, half_shift_m, shift_step_m, most_points = lattice
    inv = 1.0 / tiles.resolution_m
    stride = max(1, points.shape[0] // most_points)
    turns = int(half_turn / turn_step)
    shifts = int(half_shift_m / shift_step_m + 0.5)
    used = (points.shape[0] + stride - 1) // stride
    best, rank = -1.0, 1 << 30
    pose = centre.copy()
    if used == 0:
        return Found(pose, best, rank)
    turned = np.empty((used, 5))
    # From the middle outward: a good score early spares most of the others.
    for ka in range(first, 2 * turns + 1, step):
        a = (ka + 1) // 2 if ka % 2 else -(ka // 2)
        theta = centre[2] + a * turn_step
        _turn(points, stride, centre, theta, inv, turned)
        for ky in range(2 * shifts + 1):
            iy = (ky + 1) // 2 if ky % 2 else -(ky // 2)
            y = iy * shift_step_m
            for kx in range(2 * shifts + 1):
                ix = (kx + 1) // 2 if kx % 2 else -(kx // 2)
                x = ix * shift_step_m
                # Of two equal poses the one nearer to the prediction.
                far = FAR_COST * used * (abs(a) / (turns + 1.0) + (abs(ix) + abs(iy)) / (shifts + 1.0))
                score = _score(tiles, turned, x * inv, y * inv, far, best)
                if score > best:
                    best = score
                    pose[0], pose[1], pose[2] = centre[0] + x, centre[1] + y, theta
                    rank = (ka * (2 * shifts + 1) + ky) * (2 * shifts + 1) + kx
    return Found(pose, best, rank)


def search(
    tiles: Tiles,
    points: NDArray[np.float64],
    centre: NDArray[np.float64],
    lattice: Lattice,
    crew: Crew | None = None,
) -> Found:
    """Return the best pose of a lattice around ``centre (3,)`` for ``points (N, 5)``.

    Correlative matching (Olson 2009) on a subset of the points; gives ``mrslam.spatial.matching.gauss_newton.match`` a
    start where the prediction is poor. Where another thread of the ``crew`` has nothing to do it takes half of the
    turns; the result is the same.
    """
    turns = partial(search_turns, tiles, points, centre, lattice)
    if crew is None or not crew.is_idle:
        return turns(0, 1)
    return min(crew.both(partial(turns, 0, 2), partial(turns, 1, 2)), key=lambda half: (-half.score, half.rank))
