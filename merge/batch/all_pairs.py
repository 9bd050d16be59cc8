"""Few maps: every pair is tried, but for those that known starting poses lay far apart."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from mrslam.alignment import Prior
from mrslam.merge.batch.pair_aligner import PairAligner
from mrslam.merge.batch.vetting import vet
from mrslam.merge.graph.carried import between, sigma_at
from mrslam.merge.graph.nodes import node_of
from mrslam.spatial import se2

CAUTION = 2.0
"""Known poses' covariances are multiplied by this where they narrow a search, which must not miss the right place."""


def try_every_pair(pairs: PairAligner, T_team_map: Mapping[str, se2.Transform]) -> None:
    """Align all pairs of maps; ``T_team_map (3,)`` by name: starting poses where they are known."""
    names = sorted(pairs.grids)
    jobs = []
    for a, b in combinations(names, 2):
        prior = _prior(pairs, a, b, T_team_map)
        if prior is None or _may_touch(pairs, a, b, prior):
            jobs.append((a, b, prior))
    pairs.align_pairs(jobs, report=True)
    for cluster in pairs.clusters(names):
        vet(pairs, cluster)


def _prior(pairs: PairAligner, a: str, b: str, T_team_map: Mapping[str, se2.Transform]) -> Prior | None:
    """Return the prior of a pair by known starting poses, wide enough for maps that are bent over their size."""
    if a not in T_team_map or b not in T_team_map:
        return None
    sigma_m, sigma_rad = pairs.config.known_pose_sigma_m, pairs.config.known_pose_sigma_rad
    known = between(T_team_map[a], T_team_map[b], CAUTION * np.diag([sigma_m**2, sigma_m**2, sigma_rad**2]))
    bent_m2 = 2.0 * CAUTION * (node_of(pairs.grids[b]).diameter_m * sigma_rad) ** 2
    return Prior(known.T_a_b, known.covariance + np.diag([bent_m2, bent_m2, 0.0]))


def _may_touch(pairs: PairAligner, a: str, b: str, prior: Prior) -> bool:
    """Return whether two maps can overlap within the prior's 3 sigma, by the circles around their known cells."""
    one, two = node_of(pairs.grids[a]), node_of(pairs.grids[b])
    apart = float(np.hypot(*(one.centre_m - se2.apply(prior.T_a_b, two.centre_m))))
    slack = 3.0 * sigma_at(prior, two.centre_m)
    return apart <= 0.5 * (one.diameter_m + two.diameter_m) + slack
