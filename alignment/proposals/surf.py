"""Candidates from SURF (Bay, Ess, Tuytelaars and Van Gool 2008), in compiled loops on the integral image."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals.features import match, picture
from mrslam.alignment.result import Candidate, Prior

SIZES = ((9, 15, 21, 27), (15, 27, 39, 51))
"""Edges of the box filters, pixels, per octave."""
STEP = (1, 2)
"""Pixels between responses, per octave."""

F64 = NDArray[np.float64]


@njit(cache=True, nogil=True)
def box(ii: F64, r: int, c: int, rows: int, cols: int) -> float:  # pragma: no cover - compiled
    """Return the sum of ``rows`` x ``cols`` pixels from (r, c), clipped to the image."""
    height, width = ii.shape[0] - 1, ii.shape[1] - 1
    r0, c0 = min(max(r, 0), height), min(max(c, 0), width)
    r1, c1 = min(max(r + rows, 0), height), min(max(c + cols, 0), width)
    return ii[r1, c1] - ii[r0, c1] - ii[r1, c0] + ii[r0, c0]


@njit(cache=True, nogil=True)
def responses(ii: F64, size: int, step: int) -> F64:  # pragma: no cover - compiled
    """Return the approximated Hessian's determinant, normalised by the filter's area, on every ``step``-th pixel."""
    height, width = (ii.shape[0] - 1) // step, (ii.shape[1] - 1) // step
    out = np.zeros((height, width))
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
            out[i, j] = dxx * dyy - 0.81 * dxy * dxy
    return out


@njit(cache=True, nogil=True)
def maxima(
    below: F64, here: F64, above: F64, least: float, out: F64, scale: float, step: int
) -> int:  # pragma: no cover
    """Write (x, y, scale, response) of the maxima among 26 neighbours, sub-pixel in x and y; return how many."""
    n = 0
    for r in range(1, here.shape[0] - 1):
        for c in range(1, here.shape[1] - 1):
            v = here[r, c]
            if v < least:
                continue
            top = True
            for dr in range(-1, 2):
                for dc in range(-1, 2):
                    near = here[r + dr, c + dc]
                    if near > v or below[r + dr, c + dc] >= v or above[r + dr, c + dc] >= v:
                        top = False
            if not top or n == out.shape[0]:
                continue
            cx = here[r, c - 1] + here[r, c + 1] - 2.0 * v
            cy = here[r - 1, c] + here[r + 1, c] - 2.0 * v
            dx = 0.5 * (here[r, c - 1] - here[r, c + 1]) / cx if cx < 0.0 else 0.0
            dy = 0.5 * (here[r - 1, c] - here[r + 1, c]) / cy if cy < 0.0 else 0.0
            out[n, 0], out[n, 1] = (c + dx) * step, (r + dy) * step
            out[n, 2], out[n, 3] = scale, v
            n += 1
    return n


@njit(cache=True, nogil=True)
def haar(ii: F64, x: float, y: float, half: int) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the Haar wavelets' answers (x, y) about a point."""
    r, c = int(round(y)), int(round(x))
    dx = box(ii, r - half, c, 2 * half, half) - box(ii, r - half, c - half, 2 * half, half)
    dy = box(ii, r, c - half, half, 2 * half) - box(ii, r - half, c - half, half, 2 * half)
    return dx, dy


@njit(cache=True, nogil=True)
def describe(ii: F64, keys: F64, out: NDArray[np.float32]) -> None:  # pragma: no cover - compiled
    """Write the 64 numbers of each key point ``(N, 4)`` (x, y, scale, response), turned to its own direction."""
    angles, xs, ys = np.empty(113), np.empty(113), np.empty(113)
    for k in range(keys.shape[0]):
        x, y, s = keys[k, 0], keys[k, 1], keys[k, 2]
        n = 0
        half = max(1, int(round(2.0 * s)))
        for i in range(-6, 7):
            for j in range(-6, 7):
                if i * i + j * j >= 36:
                    continue
                dx, dy = haar(ii, x + i * s, y + j * s, half)
                weight = math.exp(-(i * i + j * j) / (2.0 * 2.5 * 2.5))
                xs[n], ys[n] = weight * dx, weight * dy
                angles[n] = math.atan2(dy, dx)
                n += 1
        best, direction = -1.0, 0.0
        for step in range(42):
            middle = -math.pi + step * 0.15
            sx = sy = 0.0
            for i in range(n):
                away = abs(angles[i] - middle)
                if min(away, 2.0 * math.pi - away) < math.pi / 6.0:
                    sx += xs[i]
                    sy += ys[i]
            if sx * sx + sy * sy > best:
                best, direction = sx * sx + sy * sy, math.atan2(sy, sx)
        cos, sin = math.cos(direction), math.sin(direction)
        half = max(1, int(round(s)))
        length = 0.0
        for bi in range(4):
            for bj in range(4):
                sdx = sdy = adx = ady = 0.0
                for i in range(-1, 6 + 1):
                    for j in range(-1, 6 + 1):
                        # Samples reach one step into the neighbouring cells, weighed down there.
                        u, v = (bj * 5 + j - 9.5) * s, (bi * 5 + i - 9.5) * s
                        dx, dy = haar(ii, x + cos * u - sin * v, y + sin * u + cos * v, half)
                        rx, ry = cos * dx + sin * dy, -sin * dx + cos * dy
                        near = math.exp(-((i - 2.0) ** 2 + (j - 2.0) ** 2) / (2.0 * 2.5 * 2.5))
                        rx, ry = near * rx, near * ry
                        sdx += rx
                        sdy += ry
                        adx += abs(rx)
                        ady += abs(ry)
                weight = math.exp(-((bi - 1.5) ** 2 + (bj - 1.5) ** 2) / (2.0 * 1.5 * 1.5))
                at = (bi * 4 + bj) * 4
                out[k, at], out[k, at + 1] = sdx * weight, sdy * weight
                out[k, at + 2], out[k, at + 3] = adx * weight, ady * weight
                length += weight * weight * (sdx * sdx + sdy * sdy + adx * adx + ady * ady)
        if length > 0.0:
            for i in range(64):
                out[k, i] /= math.sqrt(length)


def detect(image: NDArray[np.uint8], most: int) -> tuple[F64, NDArray[np.float32]]:
    """Return key points ``(N, 4)`` (x, y, scale, response; pixels) and descriptors ``(N, 64)``, strongest first."""
    ii = np.zeros((image.shape[0] + 1, image.shape[1] + 1))
    ii[1:, 1:] = (image.astype(np.float64) / 255.0).cumsum(axis=0).cumsum(axis=1)
    found = []
    for sizes, step in zip(SIZES, STEP, strict=True):
        layers = [responses(ii, size, step) for size in sizes]
        for k in (1, 2):
            out = np.empty((20_000, 4))
            n = maxima(layers[k - 1], layers[k], layers[k + 1], 1e-3, out, 1.2 * sizes[k] / 9.0, step)
            found.append(out[:n])
    keys = np.concatenate(found)
    keys = np.ascontiguousarray(keys[np.argsort(-keys[:, 3], kind="stable")][:most])
    descriptors = np.zeros((len(keys), 64), dtype=np.float32)
    describe(ii, keys, descriptors)
    return keys, descriptors


def surf(a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None) -> list[Candidate]:
    """Return transforms held by cross-checked SURF matches (Euclidean distance), best first."""
    import cv2

    sides = []
    for side in (a, b):
        image, pixel = picture(side)
        keys, descriptors = detect(image, config.orb_features)
        sides.append(((keys[:, :2] + 0.5) * pixel + (side.x0, side.y0), descriptors if len(keys) else None))
    return match(sides[0], sides[1], cv2.NORM_L2, config)
