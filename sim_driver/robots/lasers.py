"""Lasers by their published figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.errors import require, require_bounds

FARTHEST_M = 100.0
"""Farthest that a laser is mounted from its robot's centre, metres."""
BOUNDS = {
    "beams": (1, 100_000), "angle_min_rad": (-10.0, 10.0), "angle_increment_rad": (-10.0, 10.0),
    "range_min_m": (0.0, 1e3), "range_max_m": (0.001, 1e5), "noise_m": (0.0, 10.0), "noise_per_m": (0.0, 10.0),
    "dropout": (0.0, 1.0),
}  # fmt: skip
"""Least and largest value of every number."""


@dataclass(frozen=True, kw_only=True)
class LaserModel:
    """What one kind of laser sees, and how badly."""

    beams: int
    """Beams a sweep, > 0."""
    angle_min_rad: float
    """Direction of the first beam, radians."""
    angle_increment_rad: float
    """Angle from beam to beam, radians."""
    range_min_m: float
    """Nothing nearer is measured, metres."""
    range_max_m: float
    """Nothing farther is measured, metres."""
    noise_m: float
    """Range noise, one sigma, at short range, metres."""
    noise_per_m: float = 0.0
    """Range noise, one sigma, as a share of the range; the larger of the two applies."""
    dropout: float = 0.002
    """Share of beams that give no valid reading, 0..1."""
    T_base_laser: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """Where it is mounted: metres, metres, radians."""

    def __post_init__(self) -> None:
        require_bounds("laser", self, BOUNDS)
        mounted = len(self.T_base_laser) == 3 and all(abs(value) <= FARTHEST_M for value in self.T_base_laser)
        require(mounted, "laser.T_base_laser", f"(x_m, y_m, theta_rad), none beyond {FARTHEST_M:g}", self.T_base_laser)
        require(0 <= self.range_min_m < self.range_max_m, "laser.range_max_m", "> range_min_m >= 0", self.range_max_m)

    def measure(self, true_ranges_m: NDArray[np.float32], rng: np.random.Generator) -> NDArray[np.float32]:
        """Return what the laser reports for true ranges ``(B,)``: inf = no return, NaN = dropped beam."""
        noise = rng.standard_normal(true_ranges_m.size)
        dropped = rng.random(true_ranges_m.size) < self.dropout
        with np.errstate(invalid="ignore"):
            sigma = np.maximum(self.noise_m, self.noise_per_m * true_ranges_m)
            ranges = np.where(np.isfinite(true_ranges_m), true_ranges_m + sigma * noise, np.inf)
        ranges[dropped] = np.nan
        return ranges.astype(np.float32)


LASERS: Mapping[str, LaserModel] = MappingProxyType(
    {
        # Hokuyo URG-04LX specification: 240 deg, 0.36 deg steps, 0.02..5.6 m, +-10 mm to 1 m, 1 % beyond, 10 Hz.
        "urg-04lx": LaserModel(
            beams=683,
            angle_min_rad=-341 * 2 * np.pi / 1024,
            angle_increment_rad=2 * np.pi / 1024,
            range_min_m=0.02,
            range_max_m=5.6,
            noise_m=0.01,
            noise_per_m=0.01,
            dropout=0.005,
            T_base_laser=(0.05, 0.0, 0.0),
        ),
        # SICK LMS 200 technical description: 180 deg, 0.5 deg steps, 80 m in cm mode, one sigma 5 mm.
        "lms-200": LaserModel(
            beams=361,
            angle_min_rad=-np.pi / 2,
            angle_increment_rad=np.radians(0.5),
            range_min_m=0.05,
            range_max_m=80.0,
            noise_m=0.005,
            dropout=0.001,
            T_base_laser=(0.05, 0.0, 0.0),
        ),
        # The laser of the Stage worlds of Martins 2013: 180 deg, 180 beams, 5 m. Stage adds no noise; a little is real.
        "stage": LaserModel(
            beams=180,
            angle_min_rad=-np.pi / 2,
            angle_increment_rad=np.radians(1.0),
            range_min_m=0.02,
            range_max_m=5.0,
            noise_m=0.005,
            dropout=0.0,
            T_base_laser=(0.05, 0.0, 0.0),
        ),
        # Slamtec RPLIDAR A2M8 datasheet: 360 deg, 0.9 deg steps at 10 Hz, 0.15..12 m, below 1 % of the distance.
        "lidar-360": LaserModel(
            beams=400,
            angle_min_rad=-np.pi,
            angle_increment_rad=2 * np.pi / 400,
            range_min_m=0.15,
            range_max_m=12.0,
            noise_m=0.005,
            noise_per_m=0.005,
            dropout=0.005,
        ),
    }
)
"""Name -> laser."""
