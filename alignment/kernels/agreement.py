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
    contradicted: the target looks through it, and the source point is part of something ``solid``; specks come and go.
    unseen: neither. ``verdict`` ``(N,)`` receives MATCHED, OPPOSED, CONTRADICTED or UNSEEN of every ``step``-th point.
    """
    points_s, normals_s, solid_s = source.points, source.normals, source.solid
    state_t, label_t, points_t, normals_t = target.state, target.label, target.points, target.normals
    x0, y0, res = target.x0, target.y0, target.res
    height, width = state_t.shape
    cos, sin = math.cos(T_t_s[2]), math.sin(T_t_s[2])
    limit = tolerance_m * tolerance_m
    matched = opposed = against = unseen = 0
    for i in range(0, points_s.shape[0], step):
        x = T_t_s[0] + cos * points_s[i, 0] - sin * points_s[i, 1]
        y = T_t_s[1] + sin * points_s[i, 0] + cos * points_s[i, 1]
        c, r = int(math.floor((x - x0) / res)), int(math.floor((y - y0) / res))
        found = UNSEEN
        if 0 < r < height - 1 and 0 < c < width - 1:
            nx = cos * normals_s[i, 0] - sin * normals_s[i, 1]
            ny = sin * normals_s[i, 0] + cos * normals_s[i, 1]
            speck = nx == 0.0 and ny == 0.0
            own = quadrant(nx, ny)
            for k in range(4):
                j = label_t[(own + k) % 4, r, c]
                if j == NOTHING or (points_t[j, 0] - x) ** 2 + (points_t[j, 1] - y) ** 2 > limit:
                    continue
                found = OPPOSED
                mx, my = normals_t[j, 0], normals_t[j, 1]
                if speck or (mx == 0.0 and my == 0.0) or (k == 0 and nx * mx + ny * my > SAME_FACING):
                    found = MATCHED
                    break
            if (
                found == UNSEEN
                and solid_s[i]
                and free_around(state_t, r, c) >= MIN_FREE
                and not ends_behind(state_t, x - x0, y - y0, nx, ny, res, tolerance_m)
            ):
                found = CONTRADICTED
        verdict[i] = found
        if found == MATCHED:
            matched += 1
        elif found == OPPOSED:
            opposed += 1
        elif found == CONTRADICTED:
            against += 1
        else:
            unseen += 1
    return matched, opposed, against, unseen


@njit(cache=True, nogil=True)
def ends_behind(
    state: U8, x: float, y: float, nx: float, ny: float, res: float, reach_m: float
) -> bool:  # pragma: no cover - compiled
    """Return whether what the map knows ends within ``reach_m`` behind a wall at ``(x, y)`` that faces ``(nx, ny)``.

    Beams along a wall pass beside it by as much as its place is unsure, and hit it nowhere: a map that is free up to it
    and unknown behind it did not look through it. ``x``, ``y`` : metres from the left and lower edge. False for specks.
    """
    if nx == 0.0 and ny == 0.0:
        return False
    for k in range(1, int(reach_m / res + 0.5) + 1):
        c, r = int(math.floor((x - k * res * nx) / res)), int(math.floor((y - k * res * ny) / res))
        if not (0 <= r < state.shape[0] and 0 <= c < state.shape[1]) or state[r, c] == UNKNOWN:
            return True
    return False


@njit(cache=True, nogil=True, inline="always")
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
