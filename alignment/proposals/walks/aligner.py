"""The searches for a least dissimilarity as aligners: bounds of the search, candidates from what was visited."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals.dissimilarity import Dissimilarity
from mrslam.alignment.proposals.walks.log import F64, Search
from mrslam.alignment.result import Candidate, Prior
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

KEPT = 12
"""Best visited transforms handed on as candidates; a few more than are refined (``max_candidates``)."""
APART_M, APART_RAD = 0.5, 0.1
"""Visited transforms nearer than this to a better one lead to the same fit: refinement reaches 0.6 m."""


def bounds(a: PreparedMap, b: PreparedMap, prior: Prior | None) -> tuple[F64, F64, F64]:
    """Return (start, low, high) of b's middle (x, y) in frame a and its turn: anywhere within a, or near the prior."""
    if prior is not None:
        sigma = 3.0 * np.sqrt(np.diag(prior.covariance)) + (a.res, a.res, math.radians(0.5))
        middle = np.append(se2.apply(prior.T_a_b, b.centre), prior.T_a_b[2])
        lever = float(np.hypot(*b.centre)) * sigma[2]
        return middle, middle - sigma - (lever, lever, 0.0), middle + sigma + (lever, lever, 0.0)
    low = np.append(a.points.min(axis=0), -math.pi)
    high = np.append(a.points.max(axis=0), math.pi)
    return np.append(a.centre, 0.0), low, high


def about(middle: F64, b: PreparedMap) -> Transform:
    """Return the ``T_a_b`` that turns b by ``middle[2]`` and lays its centre on ``middle[:2]``."""
    turned = se2.apply(np.array([0.0, 0.0, middle[2]]), b.centre)
    return se2.transform(middle[0] - turned[0], middle[1] - turned[1], middle[2])


def searched(search: Search, evaluations: int | None = None) -> Callable[..., list[Candidate]]:
    """Return the aligner that minimises psi by ``search``; candidates are the lowest distinct ones visited."""

    def aligner(a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None) -> list[Candidate]:
        psi = Dissimilarity(a, b)
        start, low, high = bounds(a, b, prior)
        count = config.evaluations if evaluations is None else evaluations
        rng = np.random.default_rng(config.seed)
        visited = search(lambda s: psi(about(s, b)), start, low, high, count, rng)
        kept: list[F64] = []
        for row in visited[np.argsort(visited[:, 3], kind="stable")]:
            if all(
                np.hypot(*(row[:2] - k[:2])) > APART_M or abs(float(se2.wrap(row[2] - k[2]))) > APART_RAD for k in kept
            ):
                kept.append(row)
            if len(kept) == KEPT:
                break
        return [Candidate(about(row[:3], b), -float(row[3]), {"dissimilarity": float(row[3])}) for row in kept]

    return aligner
