"""How surely keyframes lie to each other: by the motion between them, and by the map that each was matched to.

A keyframe is matched to what the ones before it drew. Were that certain, the match's covariance ``H^-1`` would be its
own, and no error would add up. But they err alike: with a map drawn by the n keyframes before, each with independent
errors, ``x_k = mean(x_k-1 .. x_k-n) + e_k`` walks at random by ``(2 / (n + 1))^2 H^-1`` a keyframe in the long run.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.motion import chain_cov
from mrslam.rbpf.loops.headings import Headings
from mrslam.spatial import se2
from mrslam.spatial.pose_graph import Edges, marginal
from mrslam.spatial.se2 import Transform

DRIFT_SHARE = 0.27
"""Share of a match's covariance that adds up from keyframe to keyframe: n = 2.9. Measured in simulated offices over 4
to 32 keyframes: 0.33-0.39 along the way, 0.18-0.25 across it."""


def turned(information: NDArray[np.float64], angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return information ``(K, 3, 3)`` in frames that are turned by minus ``angles (K,)``, radians: ``R I R^T``."""
    turns = np.zeros_like(information)
    turns[:, 0, 0] = turns[:, 1, 1] = np.cos(angles)
    turns[:, 1, 0] = np.sin(angles)
    turns[:, 0, 1] = -turns[:, 1, 0]
    turns[:, 2, 2] = 1.0
    return np.asarray(turns @ information @ turns.transpose(0, 2, 1))


def chain_information(
    config: MapperConfig, arrivals: NDArray[np.float64], matched: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return ``(K, 3, 3)``: how surely each keyframe lies to the one before in the long run, in whose axes.

    ``arrivals (K, 9)`` : local motion to each; ``matched (K, 3, 3)`` : information of its match to the map, in its own
    axes, 0 where it was not matched. Both stem from one scan, but that of motion is a fiftieth where walls are seen.
    """
    return np.asarray(np.linalg.inv(chain_cov(config, arrivals)) + turned(matched, arrivals[:, 2]) / DRIFT_SHARE)


def map_covariance(
    T_map_key: Transform, chain: NDArray[np.float64], loops: Edges, headings: Headings
) -> NDArray[np.float64]:
    """Return ``(3, 3)`` of the map at the newest of the keyframes ``(K, 3)``, the first being certain; m^2, rad^2.

    ``chain (K, 3, 3)`` as :func:`chain_information` returns it. The error of the newest one's own match is to be added.
    """
    last = T_map_key.shape[0] - 1
    if last < 1:
        return np.zeros((3, 3))
    keys = np.arange(last)
    motion = Edges(keys, keys + 1, se2.between(T_map_key[:-1], T_map_key[1:]), chain[1:])
    directions, seen = headings.as_edges(T_map_key)
    return marginal(np.concatenate([T_map_key, directions]), Edges.joined([motion, loops, seen]), last)
