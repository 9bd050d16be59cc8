"""Which matches between two robots can be true together (pairwise consistency maximisation, Mangelson et al. 2018)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.alignment.stability import SAME_PLACE
from mrslam.merge.joint.consistent_kernels import grow
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import se2
from mrslam.spatial.matching.places import DRIFT_M_PER_M, DRIFT_RAD_PER_M
from mrslam.spatial.se2 import Transform

LOOSE_M, LOOSE_RAD = 0.10, 0.02
"""Standard deviation of the loop through two matches at one place, metres and radians: both matches' errors.
Drift along both robots' paths between the matches is added."""
GATE = 3.0
"""A loop closes when its error is within this number of standard deviations."""
STARTS = 20
"""Number of matches that cliques are grown from, those that agree with most others first: bounds the time."""


class KeyMatch(NamedTuple):
    """Keyframe ``j`` of one robot lies at ``T_i_j`` in the frame of keyframe ``i`` of another."""

    i: int
    j: int
    T_i_j: Transform
    """``(3,)`` metres, radians."""
    information: NDArray[np.float64]
    """``(3, 3)``, its inverse covariance: 1/m^2, 1/(m rad), 1/rad^2."""


def is_at(a: Trail, b: Trail, match: KeyMatch, T_a_b: Transform) -> bool:
    """Return whether a match has map b where ``T_a_b (3,)`` has it, as two estimates of one transform may differ."""
    T_a_j = se2.compose(a.T_map_key[match.i], match.T_i_j)
    return SAME_PLACE.is_near(se2.compose(T_a_j, se2.inverse(b.T_map_key[match.j])), T_a_b)


class Chosen(NamedTuple):
    """The consistent matches between two robots, and how strong their best rivals are."""

    keep: NDArray[np.int64]
    """Indices of a largest set whose members all agree with each other."""
    rival: int
    """Size of the largest such set among those that contradict most of the chosen."""


def agreeing(a: Trail, b: Trail, matches: Sequence[KeyMatch]) -> NDArray[np.bool_]:
    """Return ``(M, M)``: whether the loop through two matches and both robots' paths between them closes.

    It does where one match has map b at a place that lays the other's keyframe of b where that match has it.
    """
    i, j = (np.array([match[side] for match in matches], dtype=np.int64) for side in (0, 1))
    T_a_j = se2.compose(a.T_map_key[i], np.array([match.T_i_j for match in matches]))
    T_a_b = se2.compose(T_a_j, se2.inverse(b.T_map_key[j]))
    error = se2.compose(T_a_b[:, None], b.T_map_key[j][None]) - T_a_j[None]
    way_m = a.way_between(i, i) + b.way_between(j, j)
    off_m, off_rad = np.hypot(error[..., 0], error[..., 1]), np.abs(se2.wrap(error[..., 2]))
    tight_m, tight_rad = LOOSE_M + DRIFT_M_PER_M * way_m, LOOSE_RAD + DRIFT_RAD_PER_M * way_m
    closes = (off_m <= GATE * tight_m) & (off_rad <= GATE * tight_rad)
    return np.asarray(closes & closes.T)


def choose(agrees: NDArray[np.bool_]) -> Chosen:
    """Return the largest set that agrees by ``agrees (M, M)``, symmetric, and the size of its largest rival set."""
    everyone = np.arange(agrees.shape[0])
    keep = _clique(agrees, everyone)
    others = np.setdiff1d(everyone, keep)
    against = others[(~agrees[np.ix_(others, keep)]).sum(axis=1) > 0.5 * keep.size]
    return Chosen(keep, _clique(agrees, against).size)


def _clique(agrees: NDArray[np.bool_], among: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return a largest clique found greedily: the next member is the one that leaves most to choose from."""
    part = agrees[np.ix_(among, among)]
    degree, ones = part.sum(axis=1), part.view(np.int8)
    best = among[:0]
    for start in np.argsort(-degree, kind="stable")[:STARTS]:
        if degree[start] <= best.size:
            break
        best = max(best, grow(ones, start), key=len)
    return among[np.sort(best)]
