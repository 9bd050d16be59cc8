"""Robots with made-up poses, and edges between them."""

import numpy as np

from mrslam.merge.graph.edges import make_edge
from mrslam.merge.graph.nodes import Node
from mrslam.spatial import se2
from tests.merge.plans import alignment


def team(count: int, seed: int = 0):
    """Return poses and nodes of so many robots."""
    rng = np.random.default_rng(seed)
    ids = [f"r{i}" for i in range(count)]
    poses = {x: se2.transform(*rng.uniform(-20, 20, 2), rng.uniform(-3, 3)) for x in ids}
    return poses, {x: Node(area_m2=50.0, centre_m=np.zeros(2), diameter_m=10.0) for x in ids}


def edges_of(poses, pairs, confidence=0.9, wrong=()):
    """Return true edges, those in ``wrong`` off by three metres."""
    out = {}
    for i, (a, b) in enumerate(pairs):
        T_a_b = se2.between(poses[a], poses[b]) + (np.array([3.0, 0.0, 0.0]) if (a, b) in wrong else 0.0)
        value = confidence if isinstance(confidence, float) else confidence[i]
        out[a, b] = make_edge(a, b, alignment(T_a_b, value))
    return out
