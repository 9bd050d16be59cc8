"""Proposals by exhaustive search: every shift, by FFT, at given rotations."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from alignment.correlate_kernels import cyclic_count, cyclic_splat, deep_free, peaks, soft_cap
from alignment.prepared import PreparedMap
from alignment.result import Candidate

F64 = NDArray[np.float64]


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
