"""The pose that is told while the robot drives: calm, and still never far from what the filter knows."""

from __future__ import annotations

import math

import numpy as np

from rbpf.poses import between, compose
from spatial.se2 import Transform

FOLLOW, JUMP_M, JUMP_RAD = 0.25, 0.15, 0.05
"""The pose told takes this share of what it misses of the best particle's at an update, and all of it beyond a jump."""


class ToldPose:
    """Follows local motion from scan to scan, and the best particle from keyframe to keyframe.

    A particle's pose is a sample: it jitters by centimetres from update to update while local motion is good to
    millimetres. So the pose told follows slowly, but jumps where the two are far apart, as after a loop's closing.
    """

    def __init__(self) -> None:
        self.T_map_base: Transform = np.zeros(3)

    def move(self, T_before_base: Transform) -> None:
        """Go on by one scan."""
        self.T_map_base = compose(self.T_map_base, T_before_base)

    def follow(self, T_map_key: Transform) -> None:
        """Draw the pose towards the best particle's."""
        missed = between(self.T_map_base, T_map_key)
        if math.hypot(missed[0], missed[1]) > JUMP_M or abs(missed[2]) > JUMP_RAD:
            self.T_map_base = T_map_key.copy()
        else:
            self.T_map_base = compose(self.T_map_base, FOLLOW * missed)
