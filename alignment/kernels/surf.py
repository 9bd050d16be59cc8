"""Compiled loops of SURF on the integral image (Bay, Ess, Tuytelaars and Van Gool 2008)."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F64 = NDArray[np.float64]
COL, ROW, LAYER, RESPONSE = 0, 1, 2, 3
"""Columns of what ``extrema`` finds: place in samples, offset in layers, the determinant there."""
DXY_WEIGHT = 0.81
"""Weight of Dxy^2 in the determinant: w = 0.9 squared, which mends the box filters' error (section 3.2)."""
ORIENTATION_RADIUS, DESCRIPTOR_SIGMA, CELL_SIGMA = 6, 2.5, 1.5
"""Radius of the samples of an orientation, scales; sigmas of the weights of samples, scales, and of cells, cells."""
WINDOW_RAD, WINDOW_STEPS = math.pi / 3.0, 42
"""Sliding window of the orientation (section 4.1), and how many of them there are in a turn, 0.15 rad apart."""


@njit(cache=True, nogil=True)
def box(ii: F64, r: int, c: int, rows: int, cols: int) -> float:  # pragma: no cover - compiled
    """Return the sum of ``rows`` x ``cols`` pixels from (r, c), clipped to the image."""
    height, width = ii.shape[0] - 1, ii.shape[1] - 1
    r0, c0 = min(max(r, 0), height), min(max(c, 0), width)
    r1, c1 = min(max(r + rows, 0), height), min(max(c + cols, 0), width)
    return ii[r1, c1] - ii[r0, c1] - ii[r1, c0] + ii[r0, c0]


@njit(cache=True, nogil=True)
def hessian(ii: F64, size: int, step: int) -> tuple[F64, NDArray[np.bool_]]:  # pragma: no cover - compiled
    """Return the Hessian's determinant, and whether its trace (the Laplacian) is positive, on every ``step``-th pixel.

    By box filters of ``size`` pixels, normalised by their area; 0 where the filter leaves the image. ``ii``: integral
    image ``(H + 1, W + 1)``.
    """
    height, width = (ii.shape[0] - 1) // step, (ii.shape[1] - 1) // step
    determinant = np.zeros((height, width))
    positive = np.zeros((height, width), dtype=np.bool_)
    lobe, border = size // 3, size // 2
    norm = 1.0 / (size * size)
    for i in range(height):
        for j in range(width):
            r, c = i * step, j * step
            if r < border or c < border or r >= ii.shape[0] - 1 - border or c >= ii.shape[1] - 1 - border:
                continue
            dxx = box(ii, r - lobe + 1, c - border, 2 * lobe - 1, size)
            dxx -= 3.0 * box(ii, r - lobe + 1, c - lobe // 2, 2 * lobe - 1, lobe)
            dyy = box(ii, r - border, c - lobe + 1, size, 2 * lobe - 1)
            dyy -= 3.0 * box(ii, r - lobe // 2, c - lobe + 1, lobe, 2 * lobe - 1)
            dxy = box(ii, r - lobe, c + 1, lobe, lobe) + box(ii, r + 1, c - lobe, lobe, lobe)
            dxy -= box(ii, r - lobe, c - lobe, lobe, lobe) + box(ii, r + 1, c + 1, lobe, lobe)
            dxx, dyy, dxy = dxx * norm, dyy * norm, dxy * norm
            determinant[i, j] = dxx * dyy - DXY_WEIGHT * dxy * dxy
            positive[i, j] = dxx + dyy > 0.0
    return determinant, positive


@njit(cache=True, nogil=True)
def extrema(below: F64, here: F64, above: F64, least: float, out: F64) -> int:  # pragma: no cover - compiled
    """Write (col, row, layer offset, response) of the maxima among 26 neighbours; return how many.

    Interpolated by the quadratic through the neighbours (section 3.3; Brown and Lowe 2002); a maximum whose quadratic
    has its top more than one sample away is none.
    """
    n = 0
    g, H, at = np.empty(3), np.empty((3, 3)), np.empty(3)
    for r in range(1, here.shape[0] - 1):
        for c in range(1, here.shape[1] - 1):
            v = here[r, c]
            if v < least or n == out.shape[0] or not is_maximum(below, here, above, r, c):
                continue
            g[0] = 0.5 * (here[r, c + 1] - here[r, c - 1])
            g[1] = 0.5 * (here[r + 1, c] - here[r - 1, c])
            g[2] = 0.5 * (above[r, c] - below[r, c])
            H[0, 0] = here[r, c + 1] + here[r, c - 1] - 2.0 * v
            H[1, 1] = here[r + 1, c] + here[r - 1, c] - 2.0 * v
            H[2, 2] = above[r, c] + below[r, c] - 2.0 * v
            H[0, 1] = 0.25 * (here[r + 1, c + 1] - here[r + 1, c - 1] - here[r - 1, c + 1] + here[r - 1, c - 1])
            H[0, 2] = 0.25 * (above[r, c + 1] - above[r, c - 1] - below[r, c + 1] + below[r, c - 1])
            H[1, 2] = 0.25 * (above[r + 1, c] - above[r - 1, c] - below[r + 1, c] + below[r - 1, c])
            if not top_of_quadratic(g, H, at):
                continue
            out[n, COL], out[n, ROW], out[n, LAYER] = c + at[0], r + at[1], at[2]
            out[n, RESPONSE] = v + 0.5 * (g[0] * at[0] + g[1] * at[1] + g[2] * at[2])
            n += 1
    return n


@njit(cache=True, nogil=True)
def is_maximum(below: F64, here: F64, above: F64, r: int, c: int) -> bool:  # pragma: no cover - compiled
    """Return whether a sample is higher than those of the other layers about it, and none of its own is higher."""
    v = here[r, c]
    for dr in range(-1, 2):
        for dc in range(-1, 2):
            if here[r + dr, c + dc] > v or below[r + dr, c + dc] >= v or above[r + dr, c + dc] >= v:
                return False
    return True


@njit(cache=True, nogil=True)
def top_of_quadratic(g: F64, H: F64, out: F64) -> bool:  # pragma: no cover - compiled
    """Write ``-H^-1 g`` from H's upper triangle (Cramer's rule); return whether it is within one sample."""
    a, b, c, d, e, f = H[0, 0], H[0, 1], H[0, 2], H[1, 1], H[1, 2], H[2, 2]
    A, B, C = d * f - e * e, c * e - b * f, b * e - c * d
    det = a * A + b * B + c * C
    if det == 0.0:
        return False
    D, E, F = a * f - c * c, b * c - a * e, a * d - b * b
    out[0] = -(A * g[0] + B * g[1] + C * g[2]) / det
    out[1] = -(B * g[0] + D * g[1] + E * g[2]) / det
    out[2] = -(C * g[0] + E * g[1] + F * g[2]) / det
    return max(abs(out[0]), abs(out[1]), abs(out[2])) <= 1.0


@njit(cache=True, nogil=True)
def haar(ii: F64, x: float, y: float, half: int) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the Haar wavelets' responses (x, y) about a point, ``half`` of their side in pixels."""
    r, c = int(round(y)), int(round(x))
    dx = box(ii, r - half, c, 2 * half, half) - box(ii, r - half, c - half, 2 * half, half)
    dy = box(ii, r, c - half, half, 2 * half) - box(ii, r - half, c - half, half, 2 * half)
    return dx, dy


@njit(cache=True, nogil=True)
def orientation(ii: F64, x: float, y: float, s: float) -> float:  # pragma: no cover - compiled
    """Return the direction (rad) of the strongest sum of weighted wavelets within a sliding window (section 4.1)."""
    side = 2 * ORIENTATION_RADIUS + 1
    angles, xs, ys = np.empty(side * side), np.empty(side * side), np.empty(side * side)
    n = 0
    half = max(1, int(round(2.0 * s)))
    for i in range(-ORIENTATION_RADIUS, ORIENTATION_RADIUS + 1):
        for j in range(-ORIENTATION_RADIUS, ORIENTATION_RADIUS + 1):
            if i * i + j * j >= ORIENTATION_RADIUS * ORIENTATION_RADIUS:
                continue
            dx, dy = haar(ii, x + i * s, y + j * s, half)
            weight = math.exp(-(i * i + j * j) / (2.0 * DESCRIPTOR_SIGMA * DESCRIPTOR_SIGMA))
            xs[n], ys[n] = weight * dx, weight * dy
            angles[n] = math.atan2(dy, dx)
            n += 1
    best, direction = -1.0, 0.0
    for step in range(WINDOW_STEPS):
        middle = -math.pi + step * 0.15
        sx = sy = 0.0
        for i in range(n):
            away = abs(angles[i] - middle)
            if min(away, 2.0 * math.pi - away) < 0.5 * WINDOW_RAD:
                sx += xs[i]
                sy += ys[i]
        if sx * sx + sy * sy > best:
            best, direction = sx * sx + sy * sy, math.atan2(sy, sx)
    return direction


@njit(cache=True, nogil=True)
def describe(ii: F64, at: F64, scale: F64, out: NDArray[np.float32]) -> None:  # pragma: no cover - compiled
    """Write the 64 numbers of each key point, turned to its own direction; ``at``: ``(N, 2)`` x, y, pixels."""
    for k in range(at.shape[0]):
        x, y, s = at[k, 0], at[k, 1], scale[k]
        direction = orientation(ii, x, y, s)
        cos, sin = math.cos(direction), math.sin(direction)
        half = max(1, int(round(s)))
        length = 0.0
        for bi in range(4):
            for bj in range(4):
                sdx = sdy = adx = ady = 0.0
                for i in range(-1, 6 + 1):
                    for j in range(-1, 6 + 1):
                        # Samples reach one step into the neighbouring cells, with little weight there.
                        u, v = (bj * 5 + j - 9.5) * s, (bi * 5 + i - 9.5) * s
                        dx, dy = haar(ii, x + cos * u - sin * v, y + sin * u + cos * v, half)
                        rx, ry = cos * dx + sin * dy, -sin * dx + cos * dy
                        near = math.exp(-((i - 2.0) ** 2 + (j - 2.0) ** 2) / (2.0 * DESCRIPTOR_SIGMA**2))
                        rx, ry = near * rx, near * ry
                        sdx += rx
                        sdy += ry
                        adx += abs(rx)
                        ady += abs(ry)
                weight = math.exp(-((bi - 1.5) ** 2 + (bj - 1.5) ** 2) / (2.0 * CELL_SIGMA * CELL_SIGMA))
                first = (bi * 4 + bj) * 4
                out[k, first], out[k, first + 1] = sdx * weight, sdy * weight
                out[k, first + 2], out[k, first + 3] = adx * weight, ady * weight
                length += weight * weight * (sdx * sdx + sdy * sdy + adx * adx + ady * ady)
        if length > 0.0:
            for i in range(64):
                out[k, i] /= math.sqrt(length)
