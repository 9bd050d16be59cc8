"""The pose that is published while the robot drives: the best particle's, without its jitter."""

from __future__ import annotations

import math

import numpy as np

from mrslam.spatial.poses import between, compose
from mrslam.spatial.se2 import Transform

FOLLOW = 0.25
"""Share of the difference to the best particle's pose that is taken over at a keyframe: jitter shrinks to a third."""
JUMP_M, JUMP_RAD = 0.15, 0.05
"""All of the difference is taken over where it is larger than this, metres or radians: a loop closed."""


class ReportedPose:
    """Follows local motion from scan to scan, and the best particle from keyframe to keyframe.

    A particle's pose is a sample: it jitters by centimetres from update to update while local motion is good to
    millimetres. So the published pose follows slowly, but jumps where the two are far apart, as after a loop's closing.
    """

    def __init__(self) -> None:
        self.T_map_key: Transform = np.zeros(3)
        """``(3,)``, the newest keyframe as published."""

    def at(self, T_key_base: Transform) -> Transform:
        """Return the pose ``(3,)`` after this local motion since the newest keyframe."""
        return compose(self.T_map_key, T_key_base)

    def follow(self, T_map_key: Transform) -> None:
        """Draw the newest keyframe towards where the best particle has it."""
        missed = between(self.T_map_key, T_map_key)
        if math.hypot(missed[0], missed[1]) > JUMP_M or abs(missed[2]) > JUMP_RAD:
            self.T_map_key = T_map_key.copy()
        else:
            self.T_map_key = compose(self.T_map_key, FOLLOW * missed)

    def begin_key(self, T_key_next: Transform) -> None:
        """Begin the next keyframe, at this local motion ``(3,)`` from the one before."""
        self.T_map_key = compose(self.T_map_key, T_key_next)
