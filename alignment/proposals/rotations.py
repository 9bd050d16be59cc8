"""The rotations that the directions of two maps' walls suggest."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.prepared import PreparedMap

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
    first = -bins // 2 - spread - 1
    cos, sin = np.empty(-2 * first + 1), np.empty(-2 * first + 1)
    for k in range(cos.shape[0]):
        cos[k], sin[k] = math.cos((first + k) * turn), math.sin((first + k) * turn)
    for i in range(points.shape[0]):
        nx, ny = normals[i, 0], normals[i, 1]
        if nx == 0.0 and ny == 0.0:
            continue
        middle = int(round(math.atan2(ny, nx) / turn))
        for k in range(middle - spread, middle + spread + 1):
            rho = points[i, 0] * cos[k - first] + points[i, 1] * sin[k - first]
            votes[k % bins, int(math.floor(rho / cell_m)) + half] += 1.0
    out = np.zeros(bins, dtype=np.float64)
    for k in range(bins):
        for j in range(2 * half + 1):
            out[k] += votes[k, j] * votes[k, j]
    return out


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
            found.append((fine * 2 * math.pi / BINS + turn, float(smooth[k] / max(top, 1e-12))))
    return found
