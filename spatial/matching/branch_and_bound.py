"""Which poses of a wide window most points fit: branch and bound.

Hess, Kohler, Rapp, Andor 2016 (Real-time loop closure in 2D lidar SLAM), algorithm 3: grids of maxima over ever larger
squares bound the score of all poses in a square; what cannot beat the best so far is not looked into. Of several places
that score alike all are found in one pass.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

CELL_M = 0.25
"""Edge of a cell, metres: half of the shift from which matching in the coarse map finds the rest."""
DISTINCT_M, DISTINCT_RAD = 2.0, 0.3
"""Two places are distinct where they are farther apart than either."""
ALIKE = 0.8
"""Places are found that fit this share of what the best one does."""


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
def _score_quarters(
    level: NDArray[np.uint8],
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
    row: int,
    col: int,
    side: int,
    scores: NDArray[np.int64],
) -> None:  # pragma: no cover - compiled
    """Write what :func:`_score` returns at a shift, and ``side`` farther in col, row and both, to ``scores (4,)``.

    Along the rim of a level, two of its squares wide, are no walls: where one of the four is outside, none of them
    scores. One pass over the points takes a third of the time of four.
    """
    height, width = level.shape
    scores[:] = 0
    for k in range(rows.size):
        r, c = rows[k] + row, cols[k] + col
        if r >= 0 and c >= 0 and r + side < height and c + side < width:
            scores[0] += level[r, c]
            scores[1] += level[r, c + side]
            scores[2] += level[r + side, c]
            scores[3] += level[r + side, c + side]


@njit(cache=True, nogil=True)
def _is_near(d_row: float, d_col: float, turned: float) -> bool:  # pragma: no cover - compiled
    """Return whether two poses that are so many cells and radians apart are one place."""
    turned -= 2.0 * math.pi * math.floor((turned + math.pi) / (2.0 * math.pi))
    return math.hypot(d_col, d_row) < DISTINCT_M / CELL_M and abs(turned) < DISTINCT_RAD


@njit(cache=True, nogil=True)
def _is_banned(banned: NDArray[np.float64], row: int, col: int, turn: float) -> bool:  # pragma: no cover - compiled
    """Return whether a shift and turn is that of one of the ``banned (B, 3)`` places."""
    is_near = False
    for k in range(banned.shape[0]):
        is_near |= _is_near(row - banned[k, 1], col - banned[k, 0], turn - banned[k, 2])
    return is_near


@njit(cache=True, nogil=True)
def _keep(
    spots: NDArray[np.int64], count: int, pose: tuple[int, int, int, int], turns: NDArray[np.float64]
) -> int:  # pragma: no cover - compiled
    """Return the number of ``spots (K, 4)``, best first, once a ``pose`` (score, turn, row, col) is among them.

    Of poses at one place the better one is kept, and the last spot gives way where there are too many.
    """
    kept = 0
    for k in range(count):
        score, turn, row, col = spots[k]
        if not _is_near(pose[2] - row, pose[3] - col, turns[pose[1]] - turns[turn]):
            spots[kept] = spots[k]
            kept += 1
        elif score >= pose[0]:
            return count
    place = min(kept, spots.shape[0] - 1)
    while place > 0 and spots[place - 1, 0] < pose[0]:
        spots[place] = spots[place - 1]
        place -= 1
    spots[place, 0], spots[place, 1], spots[place, 2], spots[place, 3] = pose
    return min(kept + 1, spots.shape[0])


@njit(cache=True, nogil=True)
def branch_and_bound(
    levels: NDArray[np.uint8],
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
    turns: NDArray[np.float64],
    half: int,
    banned: NDArray[np.float64],
    looks_most: int,
    least: int,
    spots: NDArray[np.int64],
) -> bool:  # pragma: no cover - compiled
    """Look for distinct places that score above ``least``; return whether all were looked at.

    ``spots (K, 4)``, zeros, takes score, turn, and shift (row, col) of the best K of them, the best one first; of those
    that score no more than ``ALIKE`` of the best some may be missing.

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
    looks, count = 0, 0
    quarters = np.empty(4, dtype=np.int64)
    stack = np.empty((4 * levels.shape[0] + 4, 4), dtype=np.int64)  # score, level, row, col
    for i in np.argsort(-scores):
        if scores[i] <= least:
            break
        if looks > looks_most:
            return False
        turn, row, col = _corner(i, across, step, half)
        stack[0, 0], stack[0, 1], stack[0, 2], stack[0, 3] = scores[i], top, row, col
        depth = 1
        while depth > 0:
            depth -= 1
            score, level, row, col = stack[depth]
            if score <= least:
                continue
            if level == 0:
                if not _is_banned(banned, row, col, turns[turn]):
                    count = _keep(spots, count, (score, turn, row, col), turns)
                    least = max(least, spots[-1, 0], int(ALIKE * spots[0, 0]))
                continue
            below, first = level - 1, depth
            _score_quarters(levels[below], rows[turn], cols[turn], row, col, 1 << below, quarters)
            for k in range(4):
                r, c = row + ((k >> 1) << below), col + ((k & 1) << below)
                if r > half or c > half:
                    continue
                looks += 1
                if quarters[k] > least:
                    _push(stack, first, depth, (quarters[k], below, r, c))
                    depth += 1
    return True


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
