"""Compiled loops of the correlation: pictures of walls and of free space, and the peaks of a score."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
C64 = NDArray[np.complex64]


@njit(cache=True, nogil=True)
def deep_free(
    state: NDArray[np.uint8], label: NDArray[np.uint16], step: int, out: NDArray[np.int32]
) -> int:  # pragma: no cover
    """Write (row, col) of free cells with no wall near, on every ``step``-th row and column; return how many."""
    n = 0
    for r in range(0, state.shape[0], step):
        for c in range(0, state.shape[1], step):
            near = label[0, r, c] & label[1, r, c] & label[2, r, c] & label[3, r, c]
            if state[r, c] == 1 and near == 65535:
                out[n, 0], out[n, 1] = r, c
                n += 1
    return n


@njit(cache=True, nogil=True)
def cyclic_splat(
    points: F64, normals: F64, cos: float, sin: float, cell_m: float, row0: int, out: F32
) -> None:  # pragma: no cover - compiled
    """Add unit walls to ``out (4, H, W)``, one channel per facing +x, +y, -x, -y; bilinear, indices modulo (H, W).

    The point at the origin falls on index (-row0, 0), so that turning all points by pi mirrors the picture exactly.
    """
    height, width = out.shape[1], out.shape[2]
    for i in range(points.shape[0]):
        x = (cos * points[i, 0] - sin * points[i, 1]) / cell_m
        y = (sin * points[i, 0] + cos * points[i, 1]) / cell_m
        nx = cos * normals[i, 0] - sin * normals[i, 1]
        ny = sin * normals[i, 0] + cos * normals[i, 1]
        c, r = int(math.floor(x)), int(math.floor(y))
        fx, fy = x - c, y - r
        r -= row0
        h, v = (0 if nx > 0.0 else 2), (1 if ny > 0.0 else 3)
        for dr in range(2):
            for dc in range(2):
                w = (fx if dc else 1.0 - fx) * (fy if dr else 1.0 - fy)
                out[h, (r + dr) % height, (c + dc) % width] += w * abs(nx)
                out[v, (r + dr) % height, (c + dc) % width] += w * abs(ny)


@njit(cache=True, nogil=True)
def cyclic_count(
    points: F64, cos: float, sin: float, cell_m: float, weight: float, row0: int, out: F32
) -> None:  # pragma: no cover
    """Add ``weight`` per point to the nearest index of ``out (H, W)``, whose first row is ``row0``, modulo (H, W)."""
    height, width = out.shape
    for i in range(points.shape[0]):
        c = int(math.floor((cos * points[i, 0] - sin * points[i, 1]) / cell_m + 0.5))
        r = int(math.floor((sin * points[i, 0] + cos * points[i, 1]) / cell_m + 0.5))
        out[(r - row0) % height, c % width] += weight


@njit(cache=True, nogil=True)
def soft_cap(out: F32, cap: float) -> None:  # pragma: no cover - compiled
    """Limit the wall a cell may hold per channel: clutter does not outweigh a clean wall."""
    for k in range(out.shape[0]):
        for r in range(out.shape[1]):
            for c in range(out.shape[2]):
                out[k, r, c] = min(out[k, r, c], cap)


@njit(cache=True, nogil=True)
def multiply(SA: C64, SB: C64, out: C64) -> None:  # pragma: no cover - compiled
    """Write to ``out (2, H, W)`` the spectra of the correlations of ``SA`` with ``SB``, both ``(5, H, W)``.

    The first as they are, the second with b turned by half a turn, which swaps the facings 0 and 2, 1 and 3.
    """
    for r in range(SA.shape[1]):
        for c in range(SA.shape[2]):
            a0, a1, a2, a3, a4 = SA[0, r, c], SA[1, r, c], SA[2, r, c], SA[3, r, c], SA[4, r, c]
            b0, b1, b2, b3, b4 = SB[0, r, c], SB[1, r, c], SB[2, r, c], SB[3, r, c], SB[4, r, c]
            out[0, r, c] = (
                a0 * b0.conjugate() + a1 * b1.conjugate() + a2 * b2.conjugate() + a3 * b3.conjugate()
                + a4 * b4.conjugate()
            )  # fmt: skip
            out[1, r, c] = a0 * b2 + a1 * b3 + a2 * b0 + a3 * b1 + a4 * b4


@njit(cache=True, nogil=True)
def peaks(score: F32, count: int, radius: int) -> tuple[NDArray[np.int32], F32]:  # pragma: no cover - compiled
    """Return (row, col) and value of the ``count`` highest local maxima, more than ``radius`` cells apart, cyclic."""
    height, width = score.shape
    where = np.empty((count, 2), dtype=np.int32)
    value = np.empty(count, dtype=np.float32)
    n = 0
    for r in range(height):
        up, down = score[r - 1 if r > 0 else height - 1], score[r + 1 if r < height - 1 else 0]
        row = score[r]
        for c in range(width):
            v = row[c]
            if v <= 0.0 or (n == count and v <= value[n - 1]):
                continue
            left, right = c - 1 if c > 0 else width - 1, c + 1 if c < width - 1 else 0
            if v < row[left] or v < row[right] or v < up[c] or v < down[c]:
                continue
            keep = True
            for k in range(n):
                dr, dc = abs(where[k, 0] - r), abs(where[k, 1] - c)
                dr, dc = min(dr, height - dr), min(dc, width - dc)
                if dr <= radius and dc <= radius:
                    if value[k] >= v:
                        keep = False
                    else:  # the lower neighbour leaves
                        for m in range(k, n - 1):
                            where[m], value[m] = where[m + 1], value[m + 1]
                        n -= 1
                    break
            if not keep:
                continue
            k = min(n, count - 1)
            while k > 0 and value[k - 1] < v:
                where[k], value[k] = where[k - 1], value[k - 1]
                k -= 1
            where[k, 0], where[k, 1] = r, c
            value[k] = v
            n = min(n + 1, count)
    return where[:n].copy(), value[:n].copy()
