"""Compiled loops of preparation, verification and refinement: wall points, nearest-wall labels, agreement, normal equations."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
"""Cell states of a prepared map."""
REACH = 3
"""Half width of the window a wall's normal is taken from, cells."""

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
U8 = NDArray[np.uint8]


@njit(cache=True, nogil=True)
def wall_points(state: U8) -> tuple[I32, F64]:  # pragma: no cover - compiled
    """Return (row, col) of the walls' surfaces and their unit normals (x, y) towards the free side.

    A surface cell is occupied with a free cell among its eight neighbours. A wall free on both sides is given twice,
    once per side; a speck that has no direction gets the normal (0, 0). ``state`` has a border of REACH unknown cells.
    """
    height, width = state.shape
    count = 0
    for r in range(REACH, height - REACH):
        for c in range(REACH, width - REACH):
            if state[r, c] == OCCUPIED:
                count += 2
    cells = np.empty((count, 2), dtype=np.int32)
    normals = np.empty((count, 2), dtype=np.float64)
    n = 0
    for r in range(REACH, height - REACH):
        for c in range(REACH, width - REACH):
            if state[r, c] != OCCUPIED:
                continue
            touches = False
            for dr in range(-1, 2):
                for dc in range(-1, 2):
                    if state[r + dr, c + dc] == FREE:
                        touches = True
            if not touches:
                continue
            fx = fy = free = 0.0
            ox = oy = oxx = oxy = oyy = occ = 0.0
            for dr in range(-REACH, REACH + 1):
                for dc in range(-REACH, REACH + 1):
                    if dr * dr + dc * dc > REACH * REACH + 1:
                        continue
                    s = state[r + dr, c + dc]
                    if s == FREE:
                        fx += dc
                        fy += dr
                        free += 1.0
                    elif s == OCCUPIED:
                        ox += dc
                        oy += dr
                        oxx += dc * dc
                        oxy += dc * dr
                        oyy += dr * dr
                        occ += 1.0
            cells[n, 0] = r
            cells[n, 1] = c
            strength = math.sqrt(fx * fx + fy * fy)
            # One clean side gives about 21 of 37 / 2 free cells at a mean distance of 1.4 cells.
            if strength > 8.0:
                normals[n, 0] = fx / strength
                normals[n, 1] = fy / strength
                n += 1
                continue
            cxx = oxx - ox * ox / occ
            cyy = oyy - oy * oy / occ
            cxy = oxy - ox * oy / occ
            spread = math.sqrt((cxx - cyy) ** 2 + 4.0 * cxy * cxy)
            if occ < 4.0 or spread < 0.6 * (cxx + cyy):
                normals[n, 0] = 0.0
                normals[n, 1] = 0.0
                n += 1
                continue
            along = 0.5 * math.atan2(2.0 * cxy, cxx - cyy)
            nx, ny = -math.sin(along), math.cos(along)
            normals[n, 0] = nx
            normals[n, 1] = ny
            cells[n + 1, 0] = r
            cells[n + 1, 1] = c
            normals[n + 1, 0] = -nx
            normals[n + 1, 1] = -ny
            n += 2
    return cells[:n].copy(), normals[:n].copy()


@njit(cache=True, nogil=True)
def nearest_labels(height: int, width: int, cells: I32, reach: int) -> I32:  # pragma: no cover - compiled
    """Return ``(H, W)`` index of the nearest of ``cells`` (row, col) within ``reach`` cells, -1 where there is none."""
    label = np.full((height, width), -1, dtype=np.int32)
    best = np.full((height, width), 255, dtype=np.uint8)
    span = 2 * reach + 1
    disc = np.empty((span * span, 3), dtype=np.int32)
    m = 0
    for dr in range(-reach, reach + 1):
        for dc in range(-reach, reach + 1):
            d2 = dr * dr + dc * dc
            if d2 <= reach * reach and d2 < 255:
                disc[m, 0], disc[m, 1], disc[m, 2] = dr, dc, d2
                m += 1
    for i in range(cells.shape[0]):
        for k in range(m):
            r, c = cells[i, 0] + disc[k, 0], cells[i, 1] + disc[k, 1]
            if 0 <= r < height and 0 <= c < width and disc[k, 2] < best[r, c]:
                best[r, c] = disc[k, 2]
                label[r, c] = i
    return label


@njit(cache=True, nogil=True)
def agreement(
    points_s: F64,
    normals_s: F64,
    step: int,
    T_t_s: F64,
    state_t: U8,
    label_t: I32,
    points_t: F64,
    normals_t: F64,
    x0: float,
    y0: float,
    res: float,
    tolerance_m: float,
    verdict: U8,
) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Judge source wall points in the target map; return how many match, are opposed, contradict, are unseen.

    matched: a wall within the tolerance, of like direction, and the target is free on the same side. opposed: a wall
    there, but not so. contradicted: the target is free there. unseen: the target says nothing.
    ``verdict`` receives 1, 2, 3, 0 per point used (every ``step``-th).
    """
    height, width = state_t.shape
    cos, sin = math.cos(T_t_s[2]), math.sin(T_t_s[2])
    matched = opposed = against = unseen = 0
    limit = tolerance_m * tolerance_m
    for i in range(0, points_s.shape[0], step):
        x = T_t_s[0] + cos * points_s[i, 0] - sin * points_s[i, 1]
        y = T_t_s[1] + sin * points_s[i, 0] + cos * points_s[i, 1]
        c, r = int(math.floor((x - x0) / res)), int(math.floor((y - y0) / res))
        verdict[i] = 0
        if not (REACH < r < height - REACH - 1 and REACH < c < width - REACH - 1):
            unseen += 1
            continue
        nx = cos * normals_s[i, 0] - sin * normals_s[i, 1]
        ny = sin * normals_s[i, 0] + cos * normals_s[i, 1]
        j = label_t[r, c]
        if j >= 0 and (points_t[j, 0] - x) ** 2 + (points_t[j, 1] - y) ** 2 <= limit:
            like = True
            if (nx != 0.0 or ny != 0.0) and (normals_t[j, 0] != 0.0 or normals_t[j, 1] != 0.0):
                like = abs(nx * normals_t[j, 0] + ny * normals_t[j, 1]) > 0.7
                if like:
                    # The free side is looked up from the target's own wall, so that the tolerance is not used up twice.
                    fr = int(math.floor((points_t[j, 1] + 2.5 * res * ny - y0) / res))
                    fc = int(math.floor((points_t[j, 0] + 2.5 * res * nx - x0) / res))
                    like = False
                    for dr in range(-1, 2):
                        for dc in range(-1, 2):
                            if state_t[fr + dr, fc + dc] == FREE:
                                like = True
            if like:
                matched += 1
                verdict[i] = 1
            else:
                opposed += 1
                verdict[i] = 2
            continue
        free = 0
        for dr in range(-1, 2):
            for dc in range(-1, 2):
                if state_t[r + dr, c + dc] == FREE:
                    free += 1
        if free >= 6:
            against += 1
            verdict[i] = 3
        else:
            unseen += 1
    return matched, opposed, against, unseen


@njit(cache=True, nogil=True)
def free_overlap(
    state_s: U8, xs: float, ys: float, step: int, T_t_s: F64, state_t: U8, xt: float, yt: float, res: float
) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Compare every ``step``-th cell both ways; return how many are free/free, occupied/occupied, free/occupied, and known in s."""
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


@njit(cache=True, nogil=True)
def normal_equations(
    points_s: F64,
    normals_s: F64,
    step: int,
    T_t_s: F64,
    label_t: I32,
    points_t: F64,
    normals_t: F64,
    x0: float,
    y0: float,
    res: float,
    reach_m: float,
    scale_m: float,
    pivot_x: float,
    pivot_y: float,
    target_is_a: bool,
    H: F64,
    g: F64,
) -> tuple[int, float]:  # pragma: no cover - compiled
    """Add point-to-wall residuals to ``H (3, 3)`` and ``g (3,)``; return how many points took part, and their cost.

    Unknowns are a shift (x, y) and a turn about ``pivot``, all in frame a and applied after ``T_a_b``. With
    ``target_is_a`` the source is b; else the source is a and the residual's normal is turned into frame a.
    Residuals are weighed by the Geman-McClure kernel of ``scale_m``.
    """
    height, width = label_t.shape
    cos, sin = math.cos(T_t_s[2]), math.sin(T_t_s[2])
    used = 0
    cost = 0.0
    s2 = scale_m * scale_m
    for i in range(0, points_s.shape[0], step):
        if normals_s[i, 0] == 0.0 and normals_s[i, 1] == 0.0:
            continue
        x = T_t_s[0] + cos * points_s[i, 0] - sin * points_s[i, 1]
        y = T_t_s[1] + sin * points_s[i, 0] + cos * points_s[i, 1]
        c, r = int(math.floor((x - x0) / res)), int(math.floor((y - y0) / res))
        if not (0 <= r < height and 0 <= c < width):
            continue
        j = label_t[r, c]
        if j < 0:
            continue
        dx, dy = x - points_t[j, 0], y - points_t[j, 1]
        if dx * dx + dy * dy > reach_m * reach_m:
            continue
        mx, my = normals_t[j, 0], normals_t[j, 1]
        nx = cos * normals_s[i, 0] - sin * normals_s[i, 1]
        ny = sin * normals_s[i, 0] + cos * normals_s[i, 1]
        # A wall known from both sides is stored twice, and the label holds either side.
        if abs(mx * nx + my * ny) < 0.8:
            continue
        residual = dx * mx + dy * my
        if target_is_a:
            ax, ay = mx, my
            px, py = x, y
        else:
            # p_b - q_b turned into frame a: the moving point is q, and the residual falls as it moves along the normal.
            ax, ay = -(cos * mx + sin * my), -(-sin * mx + cos * my)
            px, py = points_s[i, 0], points_s[i, 1]
        turn = ax * -(py - pivot_y) + ay * (px - pivot_x)
        weight = s2 / (s2 + residual * residual)
        weight = weight * weight
        H[0, 0] += weight * ax * ax
        H[0, 1] += weight * ax * ay
        H[0, 2] += weight * ax * turn
        H[1, 1] += weight * ay * ay
        H[1, 2] += weight * ay * turn
        H[2, 2] += weight * turn * turn
        g[0] += weight * ax * residual
        g[1] += weight * ay * residual
        g[2] += weight * turn * residual
        cost += residual * residual / (s2 + residual * residual)
        used += 1
    return used, cost
