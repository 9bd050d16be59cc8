"""Proposals by exhaustive search: every shift, by FFT, at the few rotations that the walls' directions allow."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numba import njit
from numpy.typing import NDArray

from alignment.prepared import PreparedMap
from alignment.result import Candidate

F32 = NDArray[np.float32]
F64 = NDArray[np.float64]
BINS = 720
"""Directions in a full turn."""


@njit(cache=True, nogil=True)
def directed_spectrum(
    points: F64, normals: F64, bins: int, spread: int, cell_m: float
) -> F64:  # pragma: no cover - compiled
    """Return ``(bins,)``: how much wall faces each direction in long straight lines.

    Hough spectrum (Carpin 2008) where a point votes only for directions within ``spread`` bins of its own normal.
    """
    reach = 0.0
    for i in range(points.shape[0]):
        reach = max(reach, math.sqrt(points[i, 0] ** 2 + points[i, 1] ** 2))
    half = int(reach / cell_m) + 2
    votes = np.zeros((bins, 2 * half + 1), dtype=np.float32)
    turn = 2.0 * math.pi / bins
    for i in range(points.shape[0]):
        nx, ny = normals[i, 0], normals[i, 1]
        if nx == 0.0 and ny == 0.0:
            continue
        middle = int(round(math.atan2(ny, nx) / turn))
        for k in range(middle - spread, middle + spread + 1):
            angle = k * turn
            rho = points[i, 0] * math.cos(angle) + points[i, 1] * math.sin(angle)
            votes[k % bins, int(math.floor(rho / cell_m)) + half] += 1.0
    out = np.zeros(bins, dtype=np.float64)
    for k in range(bins):
        for j in range(2 * half + 1):
            out[k] += votes[k, j] * votes[k, j]
    return out


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


def rotations(a: PreparedMap, b: PreparedMap, most: int, floor: float = 0.0) -> list[tuple[float, float]]:
    """Return (angle rad, strength 0..1) of turns that lay the walls' directions of b on those of a, strongest first."""
    spectra = []
    for side in (a, b):
        s = directed_spectrum(side.points - side.centre, side.normals, BINS, 12, max(2 * side.res, 0.1))
        s = np.sqrt(s)
        spectra.append(s / max(float(np.linalg.norm(s)), 1e-12))
    corr = scipy.fft.irfft(scipy.fft.rfft(spectra[0]) * np.conj(scipy.fft.rfft(spectra[1])), BINS)
    half = BINS // 2
    folded = corr[:half] + corr[half:]
    kernel = np.exp(-0.5 * (np.arange(-4, 5) / 1.5) ** 2)
    wrapped = np.concatenate([folded[-4:], folded, folded[:4]])
    smooth = np.convolve(wrapped, kernel / kernel.sum(), mode="valid")
    found: list[tuple[float, float]] = []
    order = np.argsort(-smooth, kind="stable")
    top = smooth[order[0]]
    taken: list[int] = []
    for k in order:
        if len(taken) >= most or smooth[k] < floor * top:
            break
        left, right = smooth[(k - 1) % half], smooth[(k + 1) % half]
        if smooth[k] < left or smooth[k] < right:
            continue
        if any(min((k - t) % half, (t - k) % half) < 6 for t in taken):
            continue
        taken.append(int(k))
        curve = left - 2 * smooth[k] + right
        fine = k + (0.5 * (left - right) / curve if curve < 0 else 0.0)
        for turn in (0.0, math.pi):
            found.append((fine * 2 * math.pi / BINS + turn, float(smooth[k] / top)))
    return found


@njit(cache=True, nogil=True)
def cyclic_splat(
    points: F64, normals: F64, cos: float, sin: float, cell_m: float, out: F32
) -> None:  # pragma: no cover - compiled
    """Add unit walls to ``out (4, H, W)``, one channel per facing +x, +y, -x, -y; bilinear, indices modulo (H, W).

    The point at the origin falls on index (0, 0), so that turning all points by pi mirrors the picture exactly.
    """
    height, width = out.shape[1], out.shape[2]
    for i in range(points.shape[0]):
        x = (cos * points[i, 0] - sin * points[i, 1]) / cell_m
        y = (sin * points[i, 0] + cos * points[i, 1]) / cell_m
        nx = cos * normals[i, 0] - sin * normals[i, 1]
        ny = sin * normals[i, 0] + cos * normals[i, 1]
        c, r = int(math.floor(x)), int(math.floor(y))
        fx, fy = x - c, y - r
        h, v = (0 if nx > 0.0 else 2), (1 if ny > 0.0 else 3)
        for dr in range(2):
            for dc in range(2):
                w = (fx if dc else 1.0 - fx) * (fy if dr else 1.0 - fy)
                out[h, (r + dr) % height, (c + dc) % width] += w * abs(nx)
                out[v, (r + dr) % height, (c + dc) % width] += w * abs(ny)


@njit(cache=True, nogil=True)
def cyclic_count(
    points: F64, cos: float, sin: float, cell_m: float, weight: float, out: F32
) -> None:  # pragma: no cover
    """Add ``weight`` per point to the nearest index of ``out (H, W)``, modulo (H, W)."""
    height, width = out.shape
    for i in range(points.shape[0]):
        c = int(math.floor((cos * points[i, 0] - sin * points[i, 1]) / cell_m + 0.5))
        r = int(math.floor((sin * points[i, 0] + cos * points[i, 1]) / cell_m + 0.5))
        out[r % height, c % width] += weight


@njit(cache=True, nogil=True)
def soft_cap(out: F32, cap: float) -> None:  # pragma: no cover - compiled
    """Limit the wall a cell may hold per channel: clutter does not outweigh a clean wall."""
    for k in range(out.shape[0]):
        for r in range(out.shape[1]):
            for c in range(out.shape[2]):
                out[k, r, c] = min(out[k, r, c], cap)


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


def free_points(side: PreparedMap, spacing_m: float) -> F64:
    """Return ``(N, 2)`` points of free space away from walls, on a lattice of about ``spacing_m``, metres."""
    step = max(1, round(spacing_m / side.res))
    height, width = side.state.shape
    cells = np.empty(((height // step + 1) * (width // step + 1), 2), dtype=np.int32)
    n = deep_free(side.state, side.label, step, cells)
    at = cells[:n]
    return np.stack([side.x0 + (at[:, 1] + 0.5) * side.res, side.y0 + (at[:, 0] + 0.5) * side.res], axis=-1)


def correlate(
    a: PreparedMap,
    b: PreparedMap,
    angles: list[float],
    cell_m: float,
    per_angle: int = 12,
    blur_m: float = 0.25,
    against: float = 1.0,
    near: tuple[F64, float] | None = None,
) -> list[Candidate]:
    """Return the shifts that score highest at each of ``angles`` and at its opposite, best first.

    score = walls on walls that face the same way, less ``against`` x walls on free space. Walls that face away from
    each other count nothing: they may be the two sides of one wall. ``near``: where b's centre may come to lie in
    frame a, middle (2,) and radius, metres.
    """
    pa, pb = a.points - a.centre, b.points - b.centre
    radius_b = np.hypot(*pb.T).max()
    span = [int((np.ptp(pa[:, k]) + 2 * radius_b) / cell_m) + 4 for k in (1, 0)]
    shape = tuple(scipy.fft.next_fast_len(n, real=True) for n in span)
    cap = 1.5 * cell_m / a.res
    fa, fb = free_points(a, 0.5 * cell_m) - a.centre, free_points(b, 0.5 * cell_m) - b.centre
    weight = (max(1, round(0.5 * cell_m / a.res)) * a.res / cell_m) ** 2

    def spectra(points: F64, normals: F64, free: F64, angle: float) -> NDArray[np.complex64]:
        out = np.zeros((5, *shape), dtype=np.float32)
        cos, sin = math.cos(angle), math.sin(angle)
        cyclic_splat(points, normals, cos, sin, cell_m, out[:4])
        soft_cap(out[:4], cap)
        cyclic_count(free, cos, sin, cell_m, weight, out[4])
        return scipy.fft.rfft2(out)

    SA = spectra(pa, a.normals, fa, 0.0)
    ky = np.fft.fftfreq(shape[0])[:, None]
    kx = np.fft.rfftfreq(shape[1])[None, :]
    blur = np.exp(-2 * (math.pi * blur_m / cell_m) ** 2 * (kx**2 + ky**2)).astype(np.float32)
    SA *= blur
    walls_a = SA[0] + SA[1] + SA[2] + SA[3]
    rows, cols = (np.fft.fftfreq(n, 1.0 / n) for n in shape)
    outside = None
    if near is not None:
        dx, dy = a.centre[0] + cols * cell_m - near[0][0], a.centre[1] + rows * cell_m - near[0][1]
        outside = np.hypot(dx[None, :], dy[:, None]) > near[1] + cell_m
    found: list[Candidate] = []
    for angle in angles:
        SB = spectra(pb, b.normals, fb, angle)
        walls_b = SB[0] + SB[1] + SB[2] + SB[3]
        for turn in (0.0, math.pi):
            if turn == 0.0:
                product = SA[0] * SB[0].conj() + SA[1] * SB[1].conj() + SA[2] * SB[2].conj() + SA[3] * SB[3].conj()
                product -= against * (walls_a * SB[4].conj() + SA[4] * walls_b.conj())
            else:  # half a turn mirrors the picture and swaps the facings
                product = SA[0] * SB[2] + SA[1] * SB[3] + SA[2] * SB[0] + SA[3] * SB[1]
                product -= against * (walls_a * SB[4] + SA[4] * walls_b)
            score = scipy.fft.irfft2(product, s=shape)
            if outside is not None:
                score[outside] = 0.0
            where, value = peaks(score, per_angle, max(2, round(0.5 / cell_m)))
            theta = angle + turn
            cos, sin = math.cos(theta), math.sin(theta)
            back = np.array([cos * b.centre[0] - sin * b.centre[1], sin * b.centre[0] + cos * b.centre[1]])
            wrapped = math.remainder(theta, 2 * math.pi)
            x = a.centre[0] + cols[where[:, 1]] * cell_m - back[0]
            y = a.centre[1] + rows[where[:, 0]] * cell_m - back[1]
            for k in range(len(value)):
                found.append(Candidate(np.array([x[k], y[k], wrapped]), float(value[k]) * a.res))
    found.sort(key=lambda candidate: -candidate.score)
    return found
