"""Where in a large map a few scans may lie: branch and bound over all poses of a wide window.

Hess, Kohler, Rapp, Andor 2016 (Real-time loop closure in 2D lidar SLAM), algorithm 3: grids of maxima over ever larger
squares bound the score of all poses in a square; what cannot beat the best so far is not looked into.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

CELL_M = 0.25
"""Edge of a cell, metres: half of the shift from which matching in the coarse map finds the rest."""
TURN_STEP_RAD = 0.02
"""Step of the heading: moves a wall 12 m away by a cell."""
HIT, BESIDE = 2, 1
"""Score of a point on a wall's cell, and on one next to it."""
LEVELS = 7
"""Squares of up to 2^(LEVELS - 1) cells, 16 m."""
LOOKS_MOST = 100_000
"""Most squares that are looked at: bounds the time of one search, some 50 ms."""
DISTINCT_M, DISTINCT_RAD = 2.0, 0.3
"""Two places are distinct where they are farther apart than either."""


class WallGrid(NamedTuple):
    """Walls as scores, and their maxima over larger squares."""

    levels: NDArray[np.uint8]
    """``(LEVELS, rows, cols)``: level h at (r, c) is the largest score of rows r .. r + 2^h - 1, columns likewise."""
    low_m: NDArray[np.float64]
    """``(2,)``, map frame: corner of cell (0, 0)."""


class Spot(NamedTuple):
    """A pose that scans fit."""

    T_map_scan: Transform
    """``(3,)``, metres and radians, to half a cell."""
    share: float
    """0..1: score as a share of a perfect one."""


class Search(NamedTuple):
    """What a search found."""

    spot: Spot | None
    """The best pose, None where none is good enough."""
    is_complete: bool
    """Whether nothing was passed over for lack of time."""


def wall_grid(walls: NDArray[np.float64]) -> WallGrid:
    """Return the grid of points on walls, ``(N, 2)``, map frame, metres."""
    pad = 1 << LEVELS
    low = np.floor(walls.min(axis=0) / CELL_M).astype(np.int64) - pad
    size = np.floor(walls.max(axis=0) / CELL_M).astype(np.int64) - low + pad
    cells = np.floor(walls / CELL_M).astype(np.int64) - low
    levels = np.zeros((LEVELS, size[1], size[0]), dtype=np.uint8)
    base = levels[0]
    for row in (-1, 0, 1):
        for col in (-1, 0, 1):
            base[cells[:, 1] + row, cells[:, 0] + col] = BESIDE
    base[cells[:, 1], cells[:, 0]] = HIT
    for h in range(1, LEVELS):
        half, below, level = 1 << (h - 1), levels[h - 1], levels[h]
        level[:] = below
        np.maximum(level[:-half], below[half:], out=level[:-half])
        across = level.copy()
        np.maximum(level[:, :-half], across[:, half:], out=level[:, :-half])
    return WallGrid(levels, low * CELL_M)


def find(
    grid: WallGrid,
    points: NDArray[np.float64],
    centre: Transform,
    half_m: float,
    half_rad: float,
    share_least: float,
    other_than: Sequence[Transform] = (),
    looks_most: int = LOOKS_MOST,
) -> Search:
    """Return the pose that most of ``points (N, >= 2)`` fit, none where fewer than ``share_least`` would.

    Poses up to ``half_m`` and ``half_rad`` from ``centre (3,)`` are tried, but for those near ``other_than (3,)``;
    ``looks_most`` squares of them at most.
    """
    steps = math.ceil(half_rad / TURN_STEP_RAD)
    turns = (TURN_STEP_RAD * np.arange(-steps, steps + 1)).astype(np.float64)
    theta = centre[2] + turns
    c, s = np.cos(theta)[:, None], np.sin(theta)[:, None]
    x, y = points[:, 0], points[:, 1]
    cols = np.floor((centre[0] + c * x - s * y - grid.low_m[0]) / CELL_M).astype(np.int32)
    rows = np.floor((centre[1] + s * x + c * y - grid.low_m[1]) / CELL_M).astype(np.int32)
    most = HIT * points.shape[0]
    half = math.ceil(half_m / CELL_M)
    banned = np.zeros((len(other_than), 3))
    for k, other in enumerate(other_than):
        away = other - centre
        banned[k] = away[0] / CELL_M, away[1] / CELL_M, se2.wrap(away[2])
    best = np.zeros(4, dtype=np.int64)
    best[0] = int(share_least * most)
    found, is_complete = branch_and_bound(grid.levels, rows, cols, turns, half, banned, looks_most, best)
    if not found:
        return Search(None, is_complete)
    score, turn, row, col = best
    pose = np.array([centre[0] + col * CELL_M, centre[1] + row * CELL_M, se2.wrap(theta[turn])])
    return Search(Spot(pose, float(score) / most), is_complete)


@njit(cache=True, nogil=True)
def _score(
    level: NDArray[np.uint8], rows: NDArray[np.int32], cols: NDArray[np.int32], row: int, col: int
) -> int:  # pragma: no cover - compiled
    """Return the sum of a level's cells at ``rows, cols (N,)``, shifted; outside there is nothing."""
    total = 0
    height, width = level.shape
    for k in range(rows.size):
        r, c = rows[k] + row, cols[k] + col
        if 0 <= r < height and 0 <= c < width:
            total += level[r, c]
    return total


@njit(cache=True, nogil=True)
def _is_banned(banned: NDArray[np.float64], row: int, col: int, turn: float) -> bool:  # pragma: no cover - compiled
    """Return whether a shift and turn is that of one of the ``banned (B, 3)`` places."""
    for k in range(banned.shape[0]):
        turned = turn - banned[k, 2]
        turned -= 2.0 * math.pi * math.floor((turned + math.pi) / (2.0 * math.pi))
        if math.hypot(col - banned[k, 0], row - banned[k, 1]) < DISTINCT_M / CELL_M and abs(turned) < DISTINCT_RAD:
            return True
    return False


@njit(cache=True, nogil=True)
def branch_and_bound(
    levels: NDArray[np.uint8],
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
    turns: NDArray[np.float64],
    half: int,
    banned: NDArray[np.float64],
    looks_most: int,
    best: NDArray[np.int64],
) -> tuple[bool, bool]:  # pragma: no cover - compiled
    """Return whether a pose scores above ``best[0]``, and whether all were looked at.

    If so, ``best (4,)`` is its score, turn, and shift (row, col).

    ``rows, cols (T, N)`` : cells of N points for each of ``turns (T,)``; shifts are up to ``half`` cells. ``banned
    (B, 3)`` : shift (col, row) and turn of places that are left out.
    """
    top = levels.shape[0] - 1
    step = 1 << top
    across = (2 * half) // step + 1
    scores = np.empty(turns.size * across * across, dtype=np.int64)
    for i in range(scores.size):
        turn, row, col = _corner(i, across, step, half)
        scores[i] = _score(levels[top], rows[turn], cols[turn], row, col)
    looks, found = 0, False
    stack = np.empty((4 * levels.shape[0] + 4, 4), dtype=np.int64)  # score, level, row, col
    for i in np.argsort(-scores):
        if scores[i] <= best[0]:
            break
        if looks > looks_most:
            return found, False
        turn, row, col = _corner(i, across, step, half)
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = scores[i], top, row, col
        depth = 1
        while depth > 0:
            depth -= 1
            score, level, row, col = stack[depth]
            if score <= best[0]:
                continue
            if level == 0:
                if not _is_banned(banned, row, col, turns[turn]):
                    best[0], best[1], best[2], best[3] = score, turn, row, col
                    found = True
                continue
            below, first = level - 1, depth
            for k in range(4):
                r, c = row + ((k >> 1) << below), col + ((k & 1) << below)
                if r > half or c > half:
                    continue
                looks += 1
                value = _score(levels[below], rows[turn], cols[turn], r, c)
                if value > best[0]:
                    _push(stack, first, depth, (value, below, r, c))
                    depth += 1
    return found, True


@njit(cache=True, nogil=True)
def _corner(i: int, across: int, step: int, half: int) -> tuple[int, int, int]:  # pragma: no cover - compiled
    """Return turn and shift (row, col) of the corner of the ``i``-th block at the top, ``across`` to a side."""
    turn, rest = i // (across * across), i % (across * across)
    return turn, (rest // across) * step - half, (rest % across) * step - half


@njit(cache=True, nogil=True)
def _push(
    stack: NDArray[np.int64], first: int, depth: int, entry: tuple[int, int, int, int]
) -> None:  # pragma: no cover - compiled
    """Put (score, level, row, col) among the entries ``first .. depth - 1`` of a stack, the best of them on top."""
    j = depth
    while j > first and stack[j - 1, 0] > entry[0]:
        stack[j] = stack[j - 1]
        j -= 1
    stack[j, 0], stack[j, 1], stack[j, 2], stack[j, 3] = entry
