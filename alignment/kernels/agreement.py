"""Compiled loops that compare two maps under a transform, wall by wall and cell by cell."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.kernels.walls import FREE, NOTHING, UNKNOWN, WallMap

F64 = NDArray[np.float64]
U8 = NDArray[np.uint8]

UNSEEN, MATCHED, OPPOSED, CONTRADICTED = 0, 1, 2, 3
"""Verdicts on a wall point laid on another map."""
SAME_FACING = 0.7
"""Least cosine between the normals of walls that face the same way: 45 degrees, half of the way to a crossing wall."""
MIN_FREE = 6
"""Free cells of the nine about a point from which the map is free there: a straight edge of free space leaves 6."""


@njit(cache=True, nogil=True)
def quadrant(nx: float, ny: float) -> int:  # pragma: no cover - compiled
    """Return 0..3: the direction among +x, +y, -x, -y nearest to the normal."""
    if abs(nx) >= abs(ny):
        return 0 if nx > 0.0 else 2
    return 1 if ny > 0.0 else 3


@njit(cache=True, nogil=True)
def agreement(
    source: WallMap, target: WallMap, T_t_s: F64, step: int, tolerance_m: float, verdict: U8
) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Judge source wall points in the target map; return how many match, are opposed, contradict, are unseen.

    matched: a wall that faces the same way within the tolerance. opposed: a wall there, but facing otherwise.
    contradicted: the target is free there, and the source point is part of something ``solid``; specks come and go.
    unseen: neither. ``verdict`` ``(N,)`` receives MATCHED, OPPOSED, CONTRADICTED or UNSEEN of every ``step``-th point.
    """
    state = target.state
    height, width = state.shape
    cos, sin = math.cos(T_t_s[2]), math.sin(T_t_s[2])
    matched = opposed = against = unseen = 0
    for i in range(0, source.points.shape[0], step):
        px, py = source.points[i, 0], source.points[i, 1]
        x = T_t_s[0] + cos * px - sin * py
        y = T_t_s[1] + sin * px + cos * py
        c, r = int(math.floor((x - target.x0) / target.res)), int(math.floor((y - target.y0) / target.res))
        found = UNSEEN
        if 0 < r < height - 1 and 0 < c < width - 1:
            nx = cos * source.normals[i, 0] - sin * source.normals[i, 1]
            ny = sin * source.normals[i, 0] + cos * source.normals[i, 1]
            found = on_wall(target.label[:, r, c], target.points, target.normals, x, y, nx, ny, tolerance_m)
            if found == UNSEEN and source.solid[i] and free_around(state, r, c) >= MIN_FREE:
                found = CONTRADICTED
        matched += found == MATCHED
        opposed += found == OPPOSED
        against += found == CONTRADICTED
        unseen += found == UNSEEN
        verdict[i] = found
    return matched, opposed, against, unseen


@njit(cache=True, nogil=True)
def on_wall(
    labels: NDArray[np.uint16], points: F64, normals: F64, x: float, y: float, nx: float, ny: float, tolerance_m: float
) -> int:  # pragma: no cover - compiled
    """Return MATCHED, OPPOSED or UNSEEN: whether a point lies on a wall of a map, and whether that faces as it does.

    ``labels (4,)``: nearest points of the map by quadrant of facing. Specks face every way.
    """
    limit = tolerance_m * tolerance_m
    speck = nx == 0.0 and ny == 0.0
    own = quadrant(nx, ny)
    found = UNSEEN
    for k in range(4):
        j = labels[(own + k) % 4]
        if j == NOTHING or (points[j, 0] - x) ** 2 + (points[j, 1] - y) ** 2 > limit:
            continue
        if speck or (normals[j, 0] == 0.0 and normals[j, 1] == 0.0):
            return MATCHED
        if k == 0 and nx * normals[j, 0] + ny * normals[j, 1] > SAME_FACING:
            return MATCHED
        found = OPPOSED
    return found


@njit(cache=True, nogil=True)
def free_around(state: U8, r: int, c: int) -> int:  # pragma: no cover - compiled
    """Return how many of the nine cells about (r, c) are free."""
    free = 0
    for dr in range(-1, 2):
        for dc in range(-1, 2):
            if state[r + dr, c + dc] == FREE:
                free += 1
    return free


@njit(cache=True, nogil=True)
def free_overlap(
    state_s: U8, xs: float, ys: float, step: int, T_t_s: F64, state_t: U8, xt: float, yt: float, res: float
) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Compare every ``step``-th cell; return how many are free/free, occupied/occupied, unlike, and known in s."""
    height, width = state_t.shape
    cos, sin = math.cos(T_t_s[2]), math.sin(T_t_s[2])
    both_free = both_occupied = differ = known = 0
    for r in range(0, state_s.shape[0], step):
        for c in range(0, state_s.shape[1], step):
            s = state_s[r, c]
            if s == UNKNOWN:
                continue
            known += 1
            px, py = xs + (c + 0.5) * res, ys + (r + 0.5) * res
            x = T_t_s[0] + cos * px - sin * py
            y = T_t_s[1] + sin * px + cos * py
            ct, rt = int(math.floor((x - xt) / res)), int(math.floor((y - yt) / res))
            if not (0 <= rt < height and 0 <= ct < width):
                continue
            t = state_t[rt, ct]
            if t == UNKNOWN:
                continue
            if s != t:
                differ += 1
            elif s == FREE:
                both_free += 1
            else:
                both_occupied += 1
    return both_free, both_occupied, differ, known
