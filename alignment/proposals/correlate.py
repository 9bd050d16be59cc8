"""Proposals by exhaustive search: every shift, by FFT, at given rotations."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from mrslam.alignment.kernels.correlation import cyclic_count, cyclic_splat, deep_free, multiply, peaks, soft_cap
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.result import Candidate
from mrslam.spatial import se2

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
    against: float = 0.25,
    near: tuple[F64, float] | None = None,
) -> list[Candidate]:
    """Return the shifts that score highest at each of ``angles`` and at its opposite, best first.

    score = metres of wall on walls that face the same way, less ``against`` x metres of wall on free space, whatever
    the maps' cells. Walls that face away from each other count nothing: they may be the two sides of one wall.
    ``near``: where b's centre may come to lie in frame a, middle (2,) and radius, metres.
    """
    sides = [
        Picture(side.points - side.centre, side.normals, free_points(side, 0.5 * cell_m) - side.centre)
        for side in (a, b)
    ]
    cap = 1.5 * cell_m / a.res
    # The points of a metre of wall count squared where it lies on a wall, and once on free space: that weighs as many.
    weight = (max(1, round(0.5 * cell_m / a.res)) * a.res / cell_m) ** 2 * cell_m / a.res
    low_a, high_a = sides[0].box(0.0)
    boxes_b = [sides[1].box(angle) for angle in angles]
    span = (high_a - low_a + np.max([high - low for low, high in boxes_b], axis=0)) / cell_m + 4
    shape = (scipy.fft.next_fast_len(int(span[1]), real=True), scipy.fft.next_fast_len(int(span[0]), real=True))

    SA = _weighed(sides[0].spectra(0.0, cell_m, shape, cap, weight), shape, blur_m, cell_m, against)
    product = np.empty((2, *SA.shape[1:]), dtype=np.complex64)
    found: list[Candidate] = []
    for angle, (low_b, high_b) in zip(angles, boxes_b, strict=True):
        multiply(SA, sides[1].spectra(angle, cell_m, shape, cap, weight), product)
        scores = scipy.fft.irfft2(product, s=shape)
        for picture, turn, lowest in zip(scores, (0.0, math.pi), (low_a - high_b, low_a + low_b), strict=True):
            # Shifts are known modulo the picture; below the lowest the maps do not touch.
            first = np.floor(lowest / cell_m).astype(np.int64) - 1
            dx, dy = ((first[k] + (np.arange(shape[1 - k]) - first[k]) % shape[1 - k]) * cell_m for k in (0, 1))
            if near is not None:
                x, y = a.centre[0] + dx - near[0][0], a.centre[1] + dy - near[0][1]
                picture[np.hypot(x[None, :], y[:, None]) > near[1] + cell_m] = 0.0
            where, value = peaks(picture, per_angle, max(2, round(0.5 / cell_m)))
            theta = angle + turn
            back = se2.apply(np.array([0.0, 0.0, theta]), b.centre)
            wrapped = math.remainder(theta, 2 * math.pi)
            x, y = a.centre[0] + dx[where[:, 1]] - back[0], a.centre[1] + dy[where[:, 0]] - back[1]
            for k in range(len(value)):
                score = float(value[k]) * a.res**2 / cell_m
                found.append(Candidate(np.array([x[k], y[k], wrapped]), score, {"correlation_m": score}))
    found.sort(key=lambda candidate: -candidate.score)
    return found


def _weighed(
    spectra: NDArray[np.complex64], shape: tuple[int, int], blur_m: float, cell_m: float, against: float
) -> NDArray[np.complex64]:
    """Return spectra ``(5, ...)`` of a's picture, blurred, as what each of b's is multiplied with; overwrites them.

    Walls on walls count, less ``against`` x walls of either on free space of the other. ``shape`` : of the picture, in
    cells of ``cell_m``.
    """
    ky = np.fft.fftfreq(shape[0])[:, None]
    kx = np.fft.rfftfreq(shape[1])[None, :]
    spectra *= np.exp(-2 * (math.pi * blur_m / cell_m) ** 2 * (kx**2 + ky**2)).astype(np.float32)
    walls = spectra[0] + spectra[1] + spectra[2] + spectra[3]
    spectra[:4] -= np.float32(against) * spectra[4]
    spectra[4] = -np.float32(against) * walls
    return spectra


@dataclass(frozen=True, eq=False)
class Picture:
    """A map's walls and free space about the middle of its walls, as points."""

    points: F64
    """``(N, 2)`` walls, metres."""
    normals: F64
    """``(N, 2)``, see PreparedMap."""
    free: F64
    """``(M, 2)`` free space, metres."""

    def box(self, angle: float) -> tuple[F64, F64]:
        """Return the lower left and upper right corner of the walls turned by ``angle``, each ``(2,)``, metres."""
        cos, sin = math.cos(angle), math.sin(angle)
        at = self.points @ np.array([[cos, sin], [-sin, cos]])
        return at.min(axis=0), at.max(axis=0)

    def spectra(
        self, angle: float, cell_m: float, shape: tuple[int, int], cap: float, weight: float
    ) -> NDArray[np.complex64]:
        """Return the spectra ``(5, H, W // 2 + 1)`` of the map turned by ``angle``: four facings, free space."""
        cos, sin = math.cos(angle), math.sin(angle)
        y = np.concatenate([self.points, self.free]) @ np.array([sin, cos])
        row0 = math.floor(y.min() / cell_m)
        rows = min(math.floor(y.max() / cell_m) - row0 + 2, shape[0])  # most rows are empty: they need no transform
        out = np.zeros((5, rows, shape[1]), dtype=np.float32)
        cyclic_splat(self.points, self.normals, cos, sin, cell_m, row0, out[:4])
        soft_cap(out[:4], cap)
        cyclic_count(self.free, cos, sin, cell_m, weight, row0, out[4])
        full = np.zeros((5, shape[0], shape[1] // 2 + 1), dtype=np.complex64)
        full[:, (row0 + np.arange(rows)) % shape[0]] = scipy.fft.rfft(out, axis=2)
        return np.asarray(scipy.fft.fft(full, axis=1, overwrite_x=True), dtype=np.complex64)
