"""Compiled loops that lay walls on walls: normal equations and Gauss-Newton steps."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.kernels.agreement import quadrant
from mrslam.alignment.kernels.walls import NOTHING

F64 = NDArray[np.float64]


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
