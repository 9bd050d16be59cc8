"""The aligners by name: each gives candidates, all are judged by one verification."""

from __future__ import annotations

from collections.abc import Callable

from mrslam.alignment.config import AlignmentConfig
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals.features import orb
from mrslam.alignment.proposals.hough import hough
from mrslam.alignment.proposals.search import exhaustive
from mrslam.alignment.proposals.surf import surf
from mrslam.alignment.proposals.walks import (
    adaptive_walk,
    annealing,
    brute_force,
    hill_climb,
    multi_point_hill_climb,
    plain_walk,
    searched,
    simulated_annealing,
)
from mrslam.alignment.result import Candidate, Prior

Aligner = Callable[[PreparedMap, PreparedMap, AlignmentConfig, Prior | None], list[Candidate]]
"""``(a, b, config, prior) -> candidates``, best first; deterministic."""

BRUTE_FORCE = 10
"""Brute force looks at this many times ``AlignmentConfig.evaluations`` transforms, still a coarse lattice."""


def _brute(a: PreparedMap, b: PreparedMap, config: AlignmentConfig, prior: Prior | None) -> list[Candidate]:
    return searched(brute_force, BRUTE_FORCE * config.evaluations)(a, b, config, prior)


ALIGNERS: dict[str, Aligner] = {
    "auto": exhaustive,
    "orb": orb,
    "surf": surf,
    "hough": hough,
    "random-walk": searched(adaptive_walk),  # algorithm 1 of Carpin, Birk and Jucikas
    "plain-walk": searched(plain_walk),
    "multi-point-hill-climb": searched(multi_point_hill_climb),  # their algorithm 2, as printed
    "hill-climb": searched(hill_climb),  # with strides that are halved, and restarts
    "simulated-annealing": searched(simulated_annealing),  # their algorithm 3, as printed
    "annealing": searched(annealing),  # by Metropolis' rule
    "brute-force": _brute,
}
"""What ``align(method=...)`` knows."""
