"""Noticing that the robot does not get on, and wriggling free."""

from __future__ import annotations

import numpy as np

from mrslam.sim_driver.drivers.base import Command
from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

NS = 1_000_000_000
MOVED_M, TURNED_RAD = 0.08, 0.4
"""Less than this in ``stuck_after_s`` is stuck."""
BACK_OFF_M_S = -0.15


class Recovery:
    """Backs off for a random while and turns by a random angle: two robots face to face must not mirror each other."""

    def __init__(self, config: DriverConfig, rng: np.random.Generator) -> None:
        self._config, self._rng = config, rng
        self._moved_ns: int | None = None
        self._T_moved: Transform = np.zeros(3)
        self._backing_until_ns = self._turning_until_ns = 0
        self._turn_rad_s = 0.0
        self.in_a_row = 0
        """Recoveries since the robot last got on by itself."""

    def is_stuck(self, now_ns: int, T_map_base: Transform) -> bool:
        """Take note of where the robot is while it should be driving; return whether it has not got on for too long."""
        metres, radians = se2.difference(T_map_base, self._T_moved)
        if self._moved_ns is None or metres > MOVED_M or radians > TURNED_RAD:
            if self._moved_ns is not None and metres > 4 * MOVED_M:
                self.in_a_row = 0
            self._moved_ns, self._T_moved = now_ns, np.array(T_map_base)
        return now_ns - self._moved_ns > self._config.stuck_after_s * NS

    def rest(self, now_ns: int) -> None:
        """Take note that the robot stands still on purpose."""
        self._moved_ns = now_ns

    def start(self, now_ns: int) -> Command:
        """Begin to back off; return the first command."""
        self.in_a_row += 1
        self._backing_until_ns = now_ns + round(float(self._rng.uniform(0.5, 2.5)) * NS)
        self._turning_until_ns = self._backing_until_ns + round(float(self._rng.uniform(0.3, 1.8)) * NS)
        self._turn_rad_s = float(self._rng.choice([-1.0, 1.0])) * self._config.turn_rad_s
        self._moved_ns = None
        return BACK_OFF_M_S, 0.0

    def command(self, now_ns: int) -> Command | None:
        """Return what to drive while wriggling, None when that is over."""
        if now_ns < self._backing_until_ns:
            return BACK_OFF_M_S, 0.0
        return (0.0, self._turn_rad_s) if now_ns < self._turning_until_ns else None
