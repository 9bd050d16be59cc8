"""Compiled loops: wall points, nearest-wall labels, agreement of two maps, normal equations."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
"""Cell states of a prepared map."""
NOTHING = 65535
"""Label where no wall is near; also the most wall points a map may have."""
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
def nearest_labels(
    height: int, width: int, cells: I32, normals: F64, reach: int
) -> NDArray[np.uint16]:  # pragma: no cover - compiled
    """Return ``(4, H, W)``: per quadrant of facing, the nearest of ``cells`` (row, col) within ``reach``, or NOTHING.

    Quadrant q holds the walls that face within 65 degrees of q x 90 degrees, and specks. At most NOTHING cells.
    """
    label = np.full((4, height, width), NOTHING, dtype=np.uint16)
    best = np.empty((height, width), dtype=np.uint8)
    span = 2 * reach + 1
    disc = np.empty((span * span, 3), dtype=np.int32)
    m = 0
    for dr in range(-reach, reach + 1):
        for dc in range(-reach, reach + 1):
            d2 = dr * dr + dc * dc
            if d2 <= reach * reach and d2 < 255:
                disc[m, 0], disc[m, 1], disc[m, 2] = dr, dc, d2
                m += 1
    for q in range(4):
        best[:] = 255
        for i in range(cells.shape[0]):
            nx, ny = normals[i, 0], normals[i, 1]
            facing = nx if q == 0 else (ny if q == 1 else (-nx if q == 2 else -ny))
            if facing <= 0.42 and (nx != 0.0 or ny != 0.0):
                continue
            for k in range(m):
                r, c = cells[i, 0] + disc[k, 0], cells[i, 1] + disc[k, 1]
                if 0 <= r < height and 0 <= c < width and disc[k, 2] < best[r, c]:
                    best[r, c] = disc[k, 2]
                    label[q, r, c] = i
    return label


@njit(cache=True, nogil=True)
def quadrant(nx: float, ny: float) -> int:  # pragma: no cover - compiled
    """Return 0..3: the direction among +x, +y, -x, -y nearest to the normal."""
    if abs(nx) >= abs(ny):
        return 0 if nx > 0.0 else 2
    return 1 if ny > 0.0 else 3


@njit(cache=True, nogil=True)
def agreement(
    points_s: F64,
    normals_s: F64,
    step: int,
    T_t_s: F64,
    state_t: U8,
    label_t: NDArray[np.uint16],
    points_t: F64,
    normals_t: F64,
    x0: float,
    y0: float,
    res: float,
    tolerance_m: float,
    verdict: U8,
) -> tuple[int, int, int, int]:  # pragma: no cover - compiled
    """Judge source wall points in the target map; return how many match, are opposed, contradict, are unseen.

    matched: a wall that faces the same way within the tolerance. opposed: a wall there, but facing otherwise.
    contradicted: the target is free there. unseen: the target says nothing.
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
        if not (0 < r < height - 1 and 0 < c < width - 1):
            unseen += 1
            continue
        nx = cos * normals_s[i, 0] - sin * normals_s[i, 1]
        ny = sin * normals_s[i, 0] + cos * normals_s[i, 1]
        speck = nx == 0.0 and ny == 0.0
        own = quadrant(nx, ny)
        found = 0
        for k in range(4):
            q = (own + k) % 4
            j = label_t[q, r, c]
            if j == NOTHING or (points_t[j, 0] - x) ** 2 + (points_t[j, 1] - y) ** 2 > limit:
                continue
            found = 2
            plain = speck or (normals_t[j, 0] == 0.0 and normals_t[j, 1] == 0.0)
            if plain or (k == 0 and nx * normals_t[j, 0] + ny * normals_t[j, 1] > 0.7):
                found = 1
            if found == 1:
                break
        if found == 1:
            matched += 1
        elif found == 2:
            opposed += 1
        else:
            free = 0
            for dr in range(-1, 2):
                for dc in range(-1, 2):
                    if state_t[r + dr, c + dc] == FREE:
                        free += 1
            if free >= 6:
                against += 1
                found = 3
            else:
                unseen += 1
        verdict[i] = found
    return matched, opposed, against, unseen


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


@njit(cache=True, nogil=True)
def normal_equations(
    points_s: F64,
    normals_s: F64,
    step: int,
    T_t_s: F64,
    label_t: NDArray[np.uint16],
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
    height, width = label_t.shape[1], label_t.shape[2]
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
        nx = cos * normals_s[i, 0] - sin * normals_s[i, 1]
        ny = sin * normals_s[i, 0] + cos * normals_s[i, 1]
        j = label_t[quadrant(nx, ny), r, c]
        if j == NOTHING:
            continue
        dx, dy = x - points_t[j, 0], y - points_t[j, 1]
        mx, my = normals_t[j, 0], normals_t[j, 1]
        if dx * dx + dy * dy > reach_m * reach_m or mx * nx + my * ny < 0.8:
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


@njit(cache=True, nogil=True)
def solve3(H: F64, g: F64, out: F64) -> None:  # pragma: no cover - compiled
    """Solve the symmetric positive ``H x = g`` from H's upper triangle (Cramer's rule)."""
    a, b, c, d, e, f = H[0, 0], H[0, 1], H[0, 2], H[1, 1], H[1, 2], H[2, 2]
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * A + b * B + c * C
    D, E, F = a * f - c * c, b * c - a * e, a * d - b * b
    out[0] = (A * g[0] + B * g[1] + C * g[2]) / det
    out[1] = (B * g[0] + D * g[1] + E * g[2]) / det
    out[2] = (C * g[0] + E * g[1] + F * g[2]) / det


@njit(cache=True, nogil=True)
def gauss_newton(
    points_a: F64,
    normals_a: F64,
    label_a: NDArray[np.uint16],
    frame_a: tuple[float, float, float],
    points_b: F64,
    normals_b: F64,
    label_b: NDArray[np.uint16],
    frame_b: tuple[float, float, float],
    T_a_b: F64,
    pivot: F64,
    steps: tuple[int, int],
    reach_m: float,
    scale_m: float,
    rounds: int,
) -> bool:  # pragma: no cover - compiled
    """Lay walls on walls from ``T_a_b`` on, which is overwritten; return whether there was wall enough to go by.

    ``frame_*``: x0, y0, cell of the label fields; ``steps``: every how many points of a and b are used.
    """
    H, g, shift, T_b_a = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    for _ in range(rounds):
        H[:] = 0.0
        g[:] = 0.0
        cos, sin = math.cos(T_a_b[2]), math.sin(T_a_b[2])
        T_b_a[0] = -cos * T_a_b[0] - sin * T_a_b[1]
        T_b_a[1] = sin * T_a_b[0] - cos * T_a_b[1]
        T_b_a[2] = -T_a_b[2]
        used, _cost = normal_equations(
            points_b, normals_b, steps[1], T_a_b, label_a, points_a, normals_a, frame_a[0], frame_a[1], frame_a[2],
            reach_m, scale_m, pivot[0], pivot[1], True, H, g,
        )  # fmt: skip
        more, _cost = normal_equations(
            points_a, normals_a, steps[0], T_b_a, label_b, points_b, normals_b, frame_b[0], frame_b[1], frame_b[2],
            reach_m, scale_m, pivot[0], pivot[1], False, H, g,
        )  # fmt: skip
        if used + more < 10:
            return False
        # Damping by a few points' worth keeps a corridor from being thrown along itself.
        for k in range(3):
            H[k, k] += 3.0 + 1e-3 * H[k, k]
        solve3(H, g, shift)
        length = math.sqrt(shift[0] ** 2 + shift[1] ** 2)
        cut = min(1.0, 0.5 / max(length, 1e-12), 0.1 / max(abs(shift[2]), 1e-12))
        dx, dy, turn = -shift[0] * cut, -shift[1] * cut, -shift[2] * cut
        cos, sin = math.cos(turn), math.sin(turn)
        x, y = T_a_b[0] - pivot[0], T_a_b[1] - pivot[1]
        T_a_b[0] = pivot[0] + dx + cos * x - sin * y
        T_a_b[1] = pivot[1] + dy + sin * x + cos * y
        T_a_b[2] = math.atan2(math.sin(T_a_b[2] + turn), math.cos(T_a_b[2] + turn))
        if length < 1e-4 and abs(turn) < 1e-5:
            break
    return True
