"""Compiled loops that lay walls on walls: normal equations and Gauss-Newton steps."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.kernels.agreement import quadrant
from mrslam.alignment.kernels.walls import NOTHING, WallMap

F64 = NDArray[np.float64]

FACES_LIKE = 0.8
"""Least cosine between the normals of a point and its partner: 37 degrees, more than a start is off."""
MIN_POINTS = 10
"""Points below which a fit has nothing to hold on to; three unknowns, each held by a few."""
DAMPING, RELATIVE_DAMPING = 3.0, 1e-3
"""Added to the diagonal of H, points and share: keeps a corridor, along which no wall holds, from sliding."""
MAX_SHIFT_M, MAX_TURN_RAD = 0.5, 0.1
"""Longest step of one round, below the reach of the nearest walls (0.6 m)."""
SETTLED_M, SETTLED_RAD = 1e-4, 1e-5
"""Steps below this end the search: a five-hundredth of a cell, the same at 10 m from the pivot."""


@njit(cache=True, nogil=True)
def normal_equations(
    source: WallMap,
    target: WallMap,
    T_t_s: F64,
    step: int,
    reach_m: float,
    scale_m: float,
    pivot: F64,
    target_is_a: bool,
    H: F64,
    g: F64,
) -> tuple[int, float]:  # pragma: no cover - compiled
    """Add point-to-wall residuals to ``H (3, 3)`` and ``g (3,)``; return how many points took part, and their cost.

    Unknowns are a shift (x, y) and a turn about ``pivot (2,)``, all in frame a and applied after ``T_a_b``. With
    ``target_is_a`` the source is b; else the source is a and the residual's normal is turned into frame a.
    Residuals are weighed by the Geman-McClure kernel of ``scale_m``; only the upper triangle of ``H`` is filled.
    """
    points_s, normals_s, points_t, normals_t = source.points, source.normals, target.points, target.normals
    label, x0, y0, res = target.label, target.x0, target.y0, target.res
    height, width = label.shape[1], label.shape[2]
    cos, sin = math.cos(T_t_s[2]), math.sin(T_t_s[2])
    used, cost, s2 = 0, 0.0, scale_m * scale_m
    for i in range(0, points_s.shape[0], step):
        nx, ny = normals_s[i, 0], normals_s[i, 1]
        if nx == 0.0 and ny == 0.0:
            continue
        px, py = points_s[i, 0], points_s[i, 1]
        x = T_t_s[0] + cos * px - sin * py
        y = T_t_s[1] + sin * px + cos * py
        nx, ny = cos * nx - sin * ny, sin * nx + cos * ny
        c, r = int(math.floor((x - x0) / res)), int(math.floor((y - y0) / res))
        if not (0 <= r < height and 0 <= c < width):
            continue
        j = label[quadrant(nx, ny), r, c]  # the wall nearest to it that faces as it does
        if j == NOTHING:
            continue
        dx, dy = x - points_t[j, 0], y - points_t[j, 1]
        mx, my = normals_t[j, 0], normals_t[j, 1]
        if dx * dx + dy * dy > reach_m * reach_m or mx * nx + my * ny < FACES_LIKE:
            continue
        residual = dx * mx + dy * my
        if target_is_a:
            ax, ay = mx, my
            px, py = x, y
        else:
            # p_b - q_b turned into frame a: the moving point is q, and the residual falls as it moves along the normal.
            ax, ay = -(cos * mx + sin * my), -(-sin * mx + cos * my)
        add_residual(H, g, ax, ay, ax * -(py - pivot[1]) + ay * (px - pivot[0]), residual, s2)
        cost += residual * residual / (s2 + residual * residual)
        used += 1
    return used, cost


@njit(cache=True, nogil=True, inline="always")
def add_residual(
    H: F64, g: F64, ax: float, ay: float, turn: float, residual: float, s2: float
) -> None:  # pragma: no cover - compiled
    """Add one residual with the derivative (ax, ay, turn), weighed by the Geman-McClure kernel of squared scale s2."""
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
    a: WallMap,
    b: WallMap,
    T_a_b: F64,
    pivot: F64,
    steps: tuple[int, int],
    reach_m: float,
    scale_m: float,
    rounds: int,
) -> bool:  # pragma: no cover - compiled
    """Lay walls on walls starting at ``T_a_b``, which is overwritten; return whether enough wall took part.

    ``steps``: of the points of a and b every so many are used.
    """
    H, g, shift, T_b_a = np.empty((3, 3)), np.empty(3), np.empty(3), np.empty(3)
    for _ in range(rounds):
        H[:] = 0.0
        g[:] = 0.0
        cos, sin = math.cos(T_a_b[2]), math.sin(T_a_b[2])
        T_b_a[0] = -cos * T_a_b[0] - sin * T_a_b[1]
        T_b_a[1] = sin * T_a_b[0] - cos * T_a_b[1]
        T_b_a[2] = -T_a_b[2]
        used, _cost = normal_equations(b, a, T_a_b, steps[1], reach_m, scale_m, pivot, True, H, g)
        more, _cost = normal_equations(a, b, T_b_a, steps[0], reach_m, scale_m, pivot, False, H, g)
        if used + more < MIN_POINTS:
            return False
        for k in range(3):
            H[k, k] += DAMPING + RELATIVE_DAMPING * H[k, k]
        solve3(H, g, shift)
        length = math.sqrt(shift[0] ** 2 + shift[1] ** 2)
        cut = min(1.0, MAX_SHIFT_M / max(length, 1e-12), MAX_TURN_RAD / max(abs(shift[2]), 1e-12))
        dx, dy, turn = -shift[0] * cut, -shift[1] * cut, -shift[2] * cut
        cos, sin = math.cos(turn), math.sin(turn)
        x, y = T_a_b[0] - pivot[0], T_a_b[1] - pivot[1]
        T_a_b[0] = pivot[0] + dx + cos * x - sin * y
        T_a_b[1] = pivot[1] + dy + sin * x + cos * y
        T_a_b[2] = math.atan2(math.sin(T_a_b[2] + turn), math.cos(T_a_b[2] + turn))
        if length < SETTLED_M and abs(turn) < SETTLED_RAD:
            break
    return True
