"""What straight walls say of keyframes' headings, as edges of a pose graph."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.pose_graph import Edges
from mrslam.spatial.se2 import Transform

RIGHT = 0.5 * math.pi
"""A right angle, radians."""


class Headings(NamedTuple):
    """What n keyframes say of their headings: each saw one of D directions in which walls run, modulo a right angle."""

    angles: NDArray[np.float64]
    """``(D,)``, the directions in the map, radians."""
    keys: NDArray[np.int64]
    """``(n,)``, the keyframes."""
    which: NDArray[np.int64]
    """``(n,)``, index of the direction that each saw."""
    seen: NDArray[np.float64]
    """``(n,)``, that direction in the keyframe's frame, radians."""
    variance: NDArray[np.float64]
    """``(n,)``, rad^2, as if each were seen independently."""

    def as_edges(self, T_map_key: Transform) -> tuple[Transform, Edges]:
        """Return the directions as nodes ``(D, 3)`` of a pose graph, after its K keyframes, and what was seen as edges.

        Only the nodes' third column counts. ``T_map_key (K, 3)`` decides which of the four right angles each means.
        """
        nodes = np.zeros((self.angles.size, 3))
        nodes[:, 2] = self.angles
        T_key_direction, information = np.zeros((self.keys.size, 3)), np.zeros((self.keys.size, 3, 3))
        apart = self.angles[self.which] - T_map_key[self.keys, 2]
        T_key_direction[:, 2] = self.seen + RIGHT * np.round((apart - self.seen) / RIGHT)
        information[:, 2, 2] = 1.0 / self.variance
        return nodes, Edges(self.keys, T_map_key.shape[0] + self.which, T_key_direction, information)


NO_HEADINGS = Headings(np.zeros(0), np.zeros(0, np.int64), np.zeros(0, np.int64), np.zeros(0), np.zeros(0))
"""What is said where there are no walls."""
