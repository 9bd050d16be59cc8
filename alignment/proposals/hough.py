"""Candidates from Hough spectra (Carpin 2008): rotation from their correlation, shift from row and column sums."""

from __future__ import annotations

import math

import numpy as np
import scipy.fft
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.kernels.agreement import free_overlap
from mrslam.alignment.kernels.walls import OCCUPIED
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.result import Candidate, Prior
from mrslam.spatial import se2

HALF_TURN_BINS = 360
"""Directions in half a turn: the spectrum has period pi."""
ROTATIONS = 6
"""Peaks of the cross-correlation followed up, each for two rotations."""

F64 = NDArray[np.float64]


@njit(cache=True, nogil=True)
def hough_spectrum(points: F64, bins: int, cell_m: float) -> F64:  # pragma: no cover - compiled
    """Return ``(bins,)`` HS(theta) = sum over rho of HT(theta, rho)^2, theta in [0, pi), points about their middle."""
    reach = 0.0
    for i in range(points.shape[0]):
        reach = max(reach, math.hypot(points[i, 0], points[i, 1]))
    half = int(reach / cell_m) + 2
    out = np.zeros(bins)
    votes = np.zeros(2 * half + 1)
    for k in range(bins):
        votes[:] = 0.0
        cos, sin = math.cos(k * math.pi / bins), math.sin(k * math.pi / bins)
        for i in range(points.shape[0]):
            votes[int(math.floor((points[i, 0] * cos + points[i, 1] * sin) / cell_m)) + half] += 1.0
        for j in range(votes.shape[0]):
            out[k] += votes[j] * votes[j]
    return out


def occupied(side: PreparedMap) -> F64:
    """Return ``(N, 2)`` centres of occupied cells, metres."""
    rows, cols = np.nonzero(side.state == OCCUPIED)
    return np.stack([side.x0 + (cols + 0.5) * side.res, side.y0 + (rows + 0.5) * side.res], axis=-1)


def shift(one: F64, other: F64, cell_m: float) -> float:
    """Return by how much ``other`` must move so that the histograms of the two coordinates correlate best."""
    low_one, low_other = float(one.min()), float(other.min())
    sums = [
        np.bincount(((v - low) / cell_m).astype(np.int64)).astype(np.float64)
        for v, low in ((one, low_one), (other, low_other))
    ]
    count = len(sums[0]) + len(sums[1]) - 1
    size = scipy.fft.next_fast_len(count, real=True)
    product = scipy.fft.rfft(sums[0], size) * scipy.fft.rfft(sums[1][::-1], size)
    correlation = scipy.fft.irfft(product, size)[:count]
    return low_one - low_other + (int(np.argmax(correlation)) - (len(sums[1]) - 1)) * cell_m


def hough(a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None) -> list[Candidate]:
    """Return one shift for each likely rotation, ranked by acceptance index."""
    pa, pb = occupied(a), occupied(b)
    spectra = [hough_spectrum(p - p.mean(axis=0), HALF_TURN_BINS, a.res) for p in (pa, pb)]
    turned = np.fft.irfft(np.fft.rfft(spectra[0]) * np.conj(np.fft.rfft(spectra[1])), HALF_TURN_BINS)
    peaks = np.flatnonzero((turned >= np.roll(turned, 1)) & (turned >= np.roll(turned, -1)))
    peaks = peaks[np.argsort(-turned[peaks], kind="stable")][:ROTATIONS]
    found = []
    for k in peaks:
        for theta in (k * math.pi / HALF_TURN_BINS, k * math.pi / HALF_TURN_BINS + math.pi):
            q = se2.apply(np.array([0.0, 0.0, theta]), pb)
            T_a_b = se2.transform(shift(pa[:, 0], q[:, 0], a.res), shift(pa[:, 1], q[:, 1], a.res), theta)
            free, both, differ, _ = free_overlap(b.state, b.x0, b.y0, 2, T_a_b, a.state, a.x0, a.y0, a.res)
            index = (free + both) / max(free + both + differ, 1)
            found.append(Candidate(T_a_b, index, {"proposed_acceptance_index": index}))
    found.sort(key=lambda candidate: -candidate.score)
    return found
