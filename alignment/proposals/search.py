"""The default search: rotations from the walls' directions, shifts by FFT, each proposal ranked by agreement."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals.correlate import correlate
from mrslam.alignment.proposals.lattice import PRIOR_SIGMAS, lattice
from mrslam.alignment.proposals.rotations import rotations
from mrslam.alignment.result import Candidate, Prior
from mrslam.alignment.verification.verify import settled_cases
from mrslam.spatial import se2

OFFSETS_DEG = (-1.0, 0.0, 1.0)
"""Turns tried around each rotation: maps are bent, and a part of one may lie askew."""
QUICK_POINTS = 400
"""Wall points per map that settle and rank a proposal."""
SETTLED = 200
"""Most proposals settled and ranked."""
SETTLING = ((0.6, 0.25, 3), (0.4, 0.12, 3))
"""How they are: reach and kernel scale, metres, and rounds."""
CELL_M = 0.2
"""Cell of the correlation, metres."""
MOST_CELLS = 700
"""Cells along the correlation's longer side above which its cell is widened."""


def exhaustive(
    a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None, *, b_is_bent: bool = True
) -> list[Candidate]:
    """Return the distinct fits of the walls' directed correlation, best first; of a prior that is sure, those near it.

    ``b_is_bent`` : False for a part too small for that; its rotations are tried as they are, in a third of the time.
    """
    places = None if prior is None else lattice(b, prior)
    if places is not None:
        return distinct(b, settle(a, b, [Candidate(T) for T in places], config), SETTLED)
    offsets = [math.radians(offset) for offset in OFFSETS_DEG]
    near = None
    if prior is None:
        turns = [turn for turn, _ in rotations(a, b, 6, 0.7)[::2]]
        angles = [turn + offset for turn in turns for offset in offsets] if b_is_bent else turns
    else:
        sigma = np.sqrt(np.diag(prior.covariance))
        lever = float(np.hypot(*b.centre)) * sigma[2]
        near = (
            se2.apply(prior.T_a_b, b.centre),
            PRIOR_SIGMAS * float(np.hypot(*sigma[:2])) + min(PRIOR_SIGMAS * lever, 1e6),
        )
        steps = min(math.ceil(3.0 * sigma[2] / offsets[-1]), 120)
        angles = [
            prior.T_a_b[2] + 2.0 * k * offsets[-1] + offset for k in range(-steps, steps + 1) for offset in offsets[1:]
        ]
        if len(angles) > 40:  # a vague direction: take those that the walls suggest
            angles = [turn + offset for turn, _ in rotations(a, b, 6, 0.7)[::2] for offset in offsets]
    span = float(np.max(np.ptp(a.points, axis=0)) + 2 * np.hypot(*(b.points - b.centre).T).max())
    cell_m = max(CELL_M, 2 * a.res if a.res > 0.1 else 0.0, span / MOST_CELLS)
    proposals = correlate(a, b, angles, cell_m, per_angle=40, blur_m=0.75 * cell_m, against=0.5, near=near)
    return settle(a, b, distinct(b, proposals, SETTLED), config)


@njit(cache=True, nogil=True)
def thinned(
    at: NDArray[np.float64], turns: NDArray[np.float64], apart_m: float, apart_rad: float, most: int
) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return the first ``most`` rows of places ``(N, 2)`` and turns ``(N,)`` that are not next to an earlier one."""
    kept = np.empty(most, dtype=np.int64)
    n = 0
    for i in range(at.shape[0]):
        alone = True
        for k in range(n):
            j = kept[k]
            if abs(at[i, 0] - at[j, 0]) > apart_m or abs(at[i, 1] - at[j, 1]) > apart_m:
                continue
            turn = abs(turns[i] - turns[j]) % (2.0 * math.pi)
            if min(turn, 2.0 * math.pi - turn) < apart_rad:
                alone = False
                break
        if alone:
            kept[n] = i
            n += 1
            if n == most:
                break
    return kept[:n].copy()


def distinct(b: PreparedMap, proposals: list[Candidate], most: int) -> list[Candidate]:
    """Return the best ``most`` proposals without those next to a better one."""
    if not proposals:
        return []
    T_a_b = np.stack([proposal.T_a_b for proposal in proposals])
    kept = thinned(se2.apply(T_a_b, b.centre), T_a_b[:, 2].copy(), 0.3, math.radians(1.0), most)
    return [proposals[k] for k in kept]


def settle(a: PreparedMap, b: PreparedMap, proposals: list[Candidate], config: AlignmentConfig) -> list[Candidate]:
    """Return the proposals settled on the walls by a thinned refinement, ranked by thinned agreement."""
    if not proposals:
        return []
    T_a_b = np.stack([proposal.T_a_b for proposal in proposals])
    cases = settled_cases(a, b, T_a_b, SETTLING, QUICK_POINTS, 1.3 * config.tolerance_m)
    settled = [
        Candidate(T, case.worth(), proposal.evidence) for T, case, proposal in zip(T_a_b, cases, proposals, strict=True)
    ]
    settled.sort(key=lambda c: -c.score)
    return settled
