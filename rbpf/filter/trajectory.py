"""Poses of every scan: a particle's keyframes, smoothed, and the local motion from them to the scans."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.config import MapperConfig
from mrslam.rbpf.front_end.motion import CARRIED, MOTION, WAY, chain_cov
from mrslam.spatial import se2
from mrslam.spatial.pose_graph import Edges, relax
from mrslam.spatial.se2 import Transform

ANCHOR_M, ANCHOR_RAD = 0.05, 0.02
"""Standard deviations (m, rad) of a keyframe's pose by its particle, in smoothing: jitter of sampling."""


def smoothed(T_map_key: Transform, arrivals: NDArray[np.float64], config: MapperConfig) -> Transform:
    """Return a particle's keyframes ``(K, 3)`` without the jitter of sampling.

    ``T_map_key (K, 3)``. Each stays near where the filter has it; the local motion (``arrivals (K, 9)``), finer than
    the filter's samples, fixes them to each other.
    """
    count = T_map_key.shape[0]
    if count < 2:
        return T_map_key.copy()
    chain = np.arange(count - 1)
    near = np.linalg.inv(np.diag(np.square([ANCHOR_M, ANCHOR_M, ANCHOR_RAD])))
    information = np.concatenate([np.linalg.inv(chain_cov(config, arrivals)[1:]), np.tile(near, (chain.size, 1, 1))])
    edges = Edges(
        np.concatenate([chain, 0 * chain]), np.concatenate([chain + 1, chain + 1]),
        np.concatenate([arrivals[1:, MOTION], se2.between(T_map_key[0], T_map_key[1:])]), information,
    )  # fmt: skip
    return relax(T_map_key, edges, robust=np.zeros(2 * chain.size, dtype=bool))


def spread(
    T_map_key: NDArray[np.float64],
    key: NDArray[np.int64],
    T_key_base: NDArray[np.float64],
    way: NDArray[np.float64],
    arrivals: NDArray[np.float64],
) -> Transform:
    """Return ``(S, 3)`` map poses of scans that were tracked locally from keyframe ``key[i]`` on.

    ``T_key_base (S, 3)`` is the local motion since that keyframe, ``way (S,)`` its way (m), and ``arrivals (K, 9)`` the
    local motion to each keyframe from the one before. Its error at the next keyframe is spread along the way, so that
    the scans in between join both, unless the robot was carried there: where it was before does not depend on that.
    """
    poses = se2.compose(T_map_key[key], T_key_base)
    last = T_map_key.shape[0] - 1
    if last < 1:
        return poses
    nxt = np.minimum(key + 1, last)
    has_next = key < last
    # The local chain's error at the next keyframe, in the frame of its end.
    ends = se2.compose(T_map_key[key], arrivals[nxt, MOTION])
    missed = se2.between(ends, T_map_key[nxt])
    is_driven = has_next & (arrivals[nxt, CARRIED] == 0.0)
    share = np.where(is_driven, way / np.maximum(arrivals[nxt, WAY], 1e-9), 0.0)
    return se2.compose(poses, missed * np.clip(share, 0.0, 1.0)[:, None])
