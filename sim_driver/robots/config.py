"""Settings of simulated robots."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require_bounds


@dataclass(frozen=True, kw_only=True)
class OdometryConfig:
    """How wheel odometry errs: a random walk that grows with the square root of the way, and two constant misfits.

    The usual four terms (Thrun, Burgard, Fox 2005, section 5.4), as densities, so that they do not depend on the step.
    """

    translation_m_per_sqrt_m: float = 0.02
    """Error of the distance after 1 m driven, one sigma, metres, >= 0."""
    rotation_rad_per_sqrt_m: float = 0.02
    """Error of the heading after 1 m driven, one sigma, radians, >= 0."""
    rotation_rad_per_sqrt_rad: float = 0.03
    """Error of the heading after 1 rad turned, one sigma, radians, >= 0."""
    translation_m_per_sqrt_rad: float = 0.005
    """Error of the distance after 1 rad turned, one sigma, metres, >= 0."""
    scale_misfit: float = 0.01
    """Spread over robots of the constant error of distances (worn wheels), one sigma, >= 0."""
    turn_misfit: float = 0.02
    """Spread over robots of the constant error of turns (wheel base), one sigma, >= 0."""

    def __post_init__(self) -> None:
        require_bounds("odometry", self, dict.fromkeys(vars(self), (0.0, 10.0)))


@dataclass(frozen=True, kw_only=True)
class ChassisConfig:
    """A robot's body and drive."""

    radius_m: float = 0.18
    """Radius of the disc that it is, metres, > 0: for collisions, and as teammates' lasers see it."""
    max_speed_m_s: float = 0.5
    """Fastest drive, metres a second, > 0."""
    max_turn_rad_s: float = 1.5
    """Fastest turn, radians a second, > 0."""
    max_acceleration_m_s2: float = 1.0
    """Fastest change of speed, metres a second squared, > 0. Braking is as strong."""
    max_turn_acceleration_rad_s2: float = 5.0
    """Fastest change of turning rate, radians a second squared, > 0."""

    def __post_init__(self) -> None:
        require_bounds("robot", self, dict.fromkeys(vars(self), (0.001, 1e9)))
