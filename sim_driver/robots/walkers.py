"""People who walk about a world: as large as robots for a laser, and nobody's teammates."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.worlds.world import World

RADIUS_M = 0.18
"""Radius of a person as a laser sees it, metres: that of a robot, which makes the two hardest to tell apart."""
SPEED_M_S = (0.3, 1.0)
"""Slowest and fastest walk, metres a second."""
ROOM_M = 0.45
"""A person keeps so far from walls and from robots, metres."""
TURN_EVERY_S = 6.0
"""Mean time after which a person goes another way, seconds."""


class Walkers:
    """Persons who walk straight on until something is in the way, or they change their mind."""

    def __init__(self, world: World, count: int, rng: np.random.Generator) -> None:
        """Put so many persons on the floor."""
        self._world, self._rng = world, rng
        self.places_m = np.array([world.free_start(rng, ROOM_M)[:2] for _ in range(count)]).reshape(-1, 2)
        """``(N, 2)``, metres, world frame."""
        self._velocities = np.array([self._velocity() for _ in range(count)]).reshape(-1, 2)

    @property
    def radii_m(self) -> NDArray[np.float64]:
        """``(N,)``, metres."""
        return np.full(len(self.places_m), RADIUS_M)

    def step(self, robots_m: NDArray[np.float64], dt_s: float) -> None:
        """Walk for ``dt_s``; ``robots_m`` : ``(M, 2)``, which nobody walks into."""
        for k, place in enumerate(self.places_m):
            if self._rng.random() < dt_s / TURN_EVERY_S:
                self._velocities[k] = self._velocity()
            ahead = place + dt_s * self._velocities[k]
            gaps = np.hypot(*(robots_m - ahead).T) if len(robots_m) else np.array([np.inf])
            if self._world.clearance_m(ahead) < ROOM_M or gaps.min() < RADIUS_M + ROOM_M:
                self._velocities[k] = self._velocity()
            else:
                self.places_m[k] = ahead

    def _velocity(self) -> NDArray[np.float64]:
        heading, speed = self._rng.uniform(-np.pi, np.pi), self._rng.uniform(*SPEED_M_S)
        return float(speed) * np.array([np.cos(heading), np.sin(heading)])
