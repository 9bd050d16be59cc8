"""How far off the newest keyframe may be from others, by what adds up along the way between them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.pose_graph import shortest

REACH_SIGMAS, TURN_SIGMAS = 5.0, 4.0
"""Places are looked for within this number of standard deviations of position and heading. The first is larger: one
wrong turn far back is more than chance would have it."""
REACH_MOST_M, TURN_MOST_RAD = 200.0, 0.7
"""But no farther than this, metres and radians, unless the robot was carried in between."""
LEVER = 0.15
"""Distance over which an error of the heading on a way displaces its end, as a share of the way's length: 0.58 for a
straight one, 0.23 for a circle, and less where it winds."""
LEAST = 1e-9
"""Added to what adds up, so that no edge is taken for none."""


class Drift(NamedTuple):
    """How far off a pose may be."""

    reach_m: float
    """Its position, metres."""
    turn_rad: float
    """Its heading, radians."""

    @property
    def is_unknown(self) -> bool:
        """Whether it may be anywhere."""
        return self.turn_rad > TURN_MOST_RAD


def most(reach_m: NDArray[np.float64], turn_rad: NDArray[np.float64]) -> Drift:
    """Return the larger ones of what keyframes may be off for each other (metres and radians), bounded."""
    return Drift(min(float(reach_m.max()), REACH_MOST_M), min(float(turn_rad.max()), TURN_MOST_RAD))


def drift_from_newest(
    way_m: NDArray[np.float64], motion_cov: NDArray[np.float64], loops: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return how far off the newest keyframe may be for one who knows another: ``(K,)`` metres, and ``(K,)`` radians.

    ``way_m (K,)`` since the start; ``motion_cov (K, 3, 3)`` of the motion to each keyframe; ``loops (E, 2)``, keyframes
    that saw one place, between which nothing adds up. What adds up does so along the shortest way through both. Where
    the robot was carried in between, both are at least five times ``CARRIED_M`` and four times ``CARRIED_RAD``.
    """
    count = way_m.size
    ends = np.concatenate([np.stack([np.arange(count - 1), np.arange(1, count)], axis=1), loops])

    def along(chain: NDArray[np.float64]) -> NDArray[np.float64]:
        weights = np.concatenate([chain, np.zeros(len(loops))]) + LEAST
        return shortest(weights, ends, count, count - 1)

    length = along(np.diff(way_m))
    turns = along(motion_cov[1:, 2, 2])
    shifts = along(motion_cov[1:, 0, 0] + motion_cov[1:, 1, 1])
    reach_m = REACH_SIGMAS * np.sqrt(shifts + turns * (LEVER * length) ** 2)
    return reach_m, TURN_SIGMAS * np.sqrt(turns)
