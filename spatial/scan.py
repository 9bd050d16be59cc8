"""One laser scan, validated.

The rules for bad beams: what a driver reports as a range becomes one of three things.

* finite and within ``[range_min_m, range_max_m]``: a return;
* ``+inf`` or beyond ``range_max_m``: no return, stored as ``inf`` (nothing was hit up to ``range_max_m``);
* NaN, ``-inf``, zero, negative or below ``range_min_m``: a dropped beam, stored as NaN (it says nothing).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.spatial import se2
from mrslam.spatial.errors import InputError

SLOWEST_SWEEP_S = 1.0
"""No planar laser takes longer from its first beam to its last."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Scan:
    """One sweep of a planar laser.

    Raises ``InputError`` where the geometry makes no sense; bad single beams never raise.
    """

    stamp_ns: int
    """When it was taken, nanoseconds."""
    ranges_m: NDArray[np.float32]
    """``(B,) float32``, metres; inf = no return, NaN = dropped beam."""
    angle_min_rad: float
    """Direction of the first beam in the laser frame, radians, counter-clockwise."""
    angle_increment_rad: float
    """Angle from one beam to the next, radians; negative where the laser reports clockwise."""
    range_max_m: float
    """Beyond this a reading is a no-return, metres."""
    range_min_m: float = 0.0
    """Below this a reading is an error, metres."""
    T_base_laser: NDArray[np.float64] = field(default_factory=lambda: np.zeros(3))
    """``(3,)``, pose of the laser on the robot, metres and radians."""
    beam_interval_s: float = 0.0
    """Time from one beam to the next, seconds; the stamp is the first one's. 0: all at once, or not known."""

    def __post_init__(self) -> None:
        ranges = np.array(self.ranges_m, dtype=np.float32, ndmin=1, copy=True)
        if ranges.ndim != 1:
            raise InputError(f"ranges_m must have shape (beams,), got {ranges.shape}")
        for name in ("angle_min_rad", "angle_increment_rad", "range_max_m", "range_min_m", "beam_interval_s"):
            if not math.isfinite(getattr(self, name)):
                raise InputError(f"{name} must be finite, got {getattr(self, name)!r}")
        if not 0.0 <= self.range_min_m < self.range_max_m:
            raise InputError(f"need 0 <= range_min_m < range_max_m, got {self.range_min_m} m and {self.range_max_m} m")
        if abs(self.angle_increment_rad) * max(ranges.size - 1, 0) > 2.0 * np.pi + 1e-3:
            raise InputError(f"{ranges.size} beams of {self.angle_increment_rad} rad are more than a full turn")
        if not 0.0 <= self.beam_interval_s * ranges.size <= SLOWEST_SWEEP_S:
            raise InputError(
                f"{ranges.size} beams, one every {self.beam_interval_s} s, are no sweep of 0 to {SLOWEST_SWEEP_S:g} s"
            )
        T_base_laser = np.array(self.T_base_laser, dtype=np.float64)
        if T_base_laser.shape != (3,) or not np.isfinite(T_base_laser).all():
            raise InputError(f"T_base_laser must be three finite numbers, got {self.T_base_laser!r}")
        with np.errstate(invalid="ignore"):
            dropped = ~(ranges > 0.0) | (ranges < self.range_min_m)
            ranges[ranges > self.range_max_m] = np.inf
        ranges[dropped] = np.nan
        for array in (ranges, T_base_laser):
            array.flags.writeable = False
        object.__setattr__(self, "ranges_m", ranges)
        object.__setattr__(self, "T_base_laser", T_base_laser)

    @property
    def angles_rad(self) -> NDArray[np.float64]:
        """``(B,)`` beam directions in the laser frame, radians."""
        return self.angle_min_rad + self.angle_increment_rad * np.arange(self.ranges_m.size, dtype=np.float64)

    @property
    def is_return(self) -> NDArray[np.bool_]:
        """``(B,)`` which beams hit something."""
        return np.isfinite(self.ranges_m)

    def points_laser(self) -> NDArray[np.float64]:
        """``(R, 2)`` end points of the returns in the laser frame, metres, in beam order."""
        hit = self.is_return
        angles, ranges = self.angles_rad[hit], self.ranges_m[hit].astype(np.float64)
        return np.stack([ranges * np.cos(angles), ranges * np.sin(angles)], axis=-1)

    def points_base(self) -> NDArray[np.float64]:
        """``(R, 2)`` end points of the returns in the robot's base frame, metres."""
        return se2.apply(self.T_base_laser, self.points_laser())

    def with_ranges(self, ranges_m: ArrayLike) -> Scan:
        """Return the same scan with other ranges (e.g. with teammates masked out as NaN)."""
        return Scan(
            stamp_ns=self.stamp_ns,
            ranges_m=np.asarray(ranges_m, dtype=np.float32),
            angle_min_rad=self.angle_min_rad,
            angle_increment_rad=self.angle_increment_rad,
            range_max_m=self.range_max_m,
            range_min_m=self.range_min_m,
            T_base_laser=self.T_base_laser,
            beam_interval_s=self.beam_interval_s,
        )
