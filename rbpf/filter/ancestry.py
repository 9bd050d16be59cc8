"""Trajectories of the particles over all keyframes, in the map frame; what all have in common is kept once."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.rows import Rows
from mrslam.spatial.se2 import Transform

APART_MOST = 1024
"""Most keyframes that each particle remembers for itself, 24 kB; of older ones, all remember what the best one has."""
ROOM = 64
"""Keyframes there is room for at the least, so that tables are seldom copied."""


class Ancestry:
    """Trajectories of N particles over K keyframes: ``T_map_key`` by particle and keyframe."""

    def __init__(self, count: int) -> None:
        self.keys = 0
        """Number of keyframes."""
        self._shared = Rows(3)  # keyframes on which all particles agree, from the first on
        self._poses = np.zeros((count, ROOM, 3))  # (particle, keyframe) of those after

    @property
    def count(self) -> int:
        """Number of particles."""
        return self._poses.shape[0]

    @property
    def apart(self) -> Transform:
        """``(N, k, 3)``, the keyframes on which particles may differ, and always the newest."""
        return self._poses[:, : self.keys - self._shared.size]

    @property
    def ends(self) -> Transform:
        """``(N, 3)``, where each particle has the newest keyframe."""
        return self.apart[:, -1]

    def of(self, index: int) -> Transform:
        """Return ``(K, 3)``, where a particle has all keyframes."""
        return np.concatenate([self._shared.rows, self.apart[index]])

    def make_room(self, best: int) -> None:
        """Make room for a keyframe; where there are too many, all remember the older half as particle ``best`` does."""
        apart = self.apart.shape[1]
        if apart == APART_MOST:
            self._share(APART_MOST // 2, best)
        elif apart == self._poses.shape[1]:
            self._poses = np.concatenate([self._poses, np.zeros_like(self._poses)], axis=1)

    def append(self, poses: Transform) -> None:
        """Add a keyframe, ``poses (N, 3)``; there must be room."""
        self._poses[:, self.apart.shape[1]] = poses
        self.keys += 1

    def inherit(self, parents: NDArray[np.int64]) -> None:
        """Let particle ``i`` continue from ``parents[i]``."""
        apart = self.apart[parents]
        differ = (apart != apart[:1]).any(axis=(0, 2))[:-1]
        common = int(np.argmax(differ)) if differ.any() else differ.size
        self._poses = apart
        self._share(common, 0)

    def replace(self, trajectory: Transform) -> None:
        """Let all particles continue from this trajectory ``(K, 3)``."""
        self._shared = Rows.of(trajectory[:-1])
        self._poses = np.zeros((self.count, ROOM, 3))
        self._poses[:, 0] = trajectory[-1]

    def _share(self, count: int, index: int) -> None:
        """Keep the oldest ``count`` keyframes that particles remember for themselves once, as one of them has them."""
        apart = self.apart
        for pose in apart[index, :count]:
            self._shared.add(pose)
        rest = apart[:, count:]
        self._poses = np.zeros((apart.shape[0], max(ROOM, 2 * rest.shape[1]), 3))
        self._poses[:, : rest.shape[1]] = rest

    def state(self) -> list[Any]:
        """Return all of it."""
        return [self._shared.rows, self.apart]

    def restore(self, state: list[Any]) -> None:
        """Continue from what :meth:`state` returned."""
        self._shared, poses = Rows.of(state[0]), state[1]
        self.keys = self._shared.size + poses.shape[1]
        self._poses = np.concatenate([poses, np.zeros((poses.shape[0], max(ROOM, poses.shape[1]), 3))], axis=1)
