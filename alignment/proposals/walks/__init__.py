"""Searches for the transform of least dissimilarity (Carpin, Birk and Jucikas 2005), all of one signature."""

from mrslam.alignment.proposals.walks.aligner import about, bounds, searched
from mrslam.alignment.proposals.walks.annealings import annealing, simulated_annealing
from mrslam.alignment.proposals.walks.climbs import hill_climb, multi_point_hill_climb
from mrslam.alignment.proposals.walks.lattice import brute_force
from mrslam.alignment.proposals.walks.log import Objective, Search
from mrslam.alignment.proposals.walks.random_walk import adaptive_walk, plain_walk

__all__ = [
    "Objective",
    "Search",
    "about",
    "adaptive_walk",
    "annealing",
    "bounds",
    "brute_force",
    "hill_climb",
    "multi_point_hill_climb",
    "plain_walk",
    "searched",
    "simulated_annealing",
]
