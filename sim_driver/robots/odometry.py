"""Wheel odometry that errs as real wheels do."""

from __future__ import annotations

import numpy as np

from mrslam.sim_driver.robots.config import OdometryConfig
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

STILL = 1e-9
"""Motion below this is rounding, not motion: metres, radians."""


class Odometry:
    """Sums up noisy increments of motion."""

    def __init__(self, config: OdometryConfig, rng: np.random.Generator) -> None:
        """Draw this robot's constant misfits from ``rng`` and start at the origin of its odometry frame."""
        self._config, self._rng = config, rng
        self._scale = 1.0 + config.scale_misfit * float(np.clip(rng.standard_normal(), -2.5, 2.5))
        self._turn = 1.0 + config.turn_misfit * float(np.clip(rng.standard_normal(), -2.5, 2.5))
        self.T_odom_base: Transform = np.zeros(3)

    def advance(self, T_before_after: Transform) -> None:
        """Add one true motion of the base, with its error; no motion, no error."""
        config = self._config
        dx, dy, turn = (float(v) for v in T_before_after)
        way, turned = float(np.hypot(dx, dy)), abs(turn)
        along, across, heading = self._rng.standard_normal(3)
        if way < STILL and turned < STILL:
            return
        sigma_m = np.sqrt(config.translation_m_per_sqrt_m**2 * way + config.translation_m_per_sqrt_rad**2 * turned)
        sigma_rad = np.sqrt(config.rotation_rad_per_sqrt_m**2 * way + config.rotation_rad_per_sqrt_rad**2 * turned)
        measured = se2.transform(
            self._scale * dx + sigma_m * along,
            self._scale * dy + 0.3 * sigma_m * across,  # wheels slip sideways less than they roll wrong
            self._turn * turn + sigma_rad * heading,
        )
        self.T_odom_base = se2.compose(self.T_odom_base, measured)
