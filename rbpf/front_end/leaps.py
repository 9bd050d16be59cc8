"""Odometry from scan to scan, used or not: a leap is known by the steps around it, though no scan shows the place.

A match tells a leap from motion where both of its scans are used. Where one is refused (a laser that is stuck, random
ranges, too few returns), what odometry says over all the scans that were refused would be lost for one leap among them.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mrslam.rbpf.front_end.prediction import STEADY_S, can_move
from mrslam.spatial.poses import between, compose
from mrslam.spatial.se2 import Transform, inverse


class Steps:
    """Follows odometry from each scan to the next."""

    def __init__(self) -> None:
        """Start with nothing told."""
        self._stamp_ns = 0
        self._T_odom_base: Transform | None = None
        self._velocity: Transform = np.zeros(3)  # by the last step that a robot can make, m/s and rad/s
        self._leap: Transform | None = None  # the newest step, where no robot makes it
        self._likely: Transform = np.zeros(3)  # what the robot did meanwhile

    def take(self, stamp_ns: int, T_odom_base: Transform | None) -> None:
        """Take odometry ``(3,)`` at a scan, if there is some."""
        before, self._leap = self._T_odom_base, None
        elapsed_s = (stamp_ns - self._stamp_ns) / 1e9
        self._stamp_ns, self._T_odom_base = stamp_ns, T_odom_base
        if before is None or T_odom_base is None:
            return
        step = between(before, T_odom_base)
        if not can_move(step, elapsed_s):
            self._leap, self._likely = step, self._velocity * min(max(elapsed_s, 0.0), STEADY_S)
        elif elapsed_s > 0.0:
            self._velocity = step / elapsed_s

    def without_leap(self, T_odom_before: Transform) -> Transform:
        """Return an earlier pose by odometry ``(3,)``, moved as the newest leap has moved odometry; as it was without.

        The motion from there is then what odometry told before and after, and what it told last while it leapt.
        """
        if self._leap is None or self._T_odom_base is None:
            return T_odom_before
        T_odom_likely = compose(compose(self._T_odom_base, inverse(self._leap)), self._likely)
        return compose(self._T_odom_base, between(T_odom_likely, T_odom_before))

    def state(self) -> list[Any]:
        """Return everything that resumed steps need."""
        return [self._stamp_ns, self._T_odom_base, self._velocity]

    def restore(self, state: list[Any]) -> None:
        """Become the steps that were saved."""
        self._stamp_ns, self._T_odom_base, self._velocity = state
