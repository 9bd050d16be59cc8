"""Settings of the drivers."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require


@dataclass(frozen=True, kw_only=True)
class DriverConfig:
    """How robots plan and drive."""

    robot_radius_m: float = 0.18
    """Radius of the robot's body, metres, > 0."""
    margin_m: float = 0.06
    """Room kept beside the body, metres, >= 0. More: safer, but narrow doors close."""
    comfort_m: float = 0.35
    """Walls nearer than this to the body make a path dearer, metres, > 0."""
    speed_m_s: float = 0.5
    """Cruising speed, metres a second, > 0."""
    turn_rad_s: float = 1.2
    """Fastest turn asked for, radians a second, > 0."""
    look_ahead_m: float = 0.4
    """Distance of the path point steered at, metres, > 0. More: smoother, but corners are cut."""
    plan_resolution_m: float = 0.05
    """Finest cells that paths are planned on, metres, > 0."""
    max_plan_cells: int = 60_000
    """Maps with more cells are planned on coarser ones, > 0: bounds the time a plan takes."""
    plan_interval_s: float = 1.5
    """How often paths and goals are reconsidered, seconds, > 0."""
    min_frontier_m: float = 0.4
    """Shorter borders to the unknown are not worth a visit, metres, > 0."""
    path_scale: float = 1.0
    """Cost of a frontier per metre of way to it, > 0."""
    gain_scale: float = 0.3
    """Gain of a frontier per metre of its length (up to 5 m), >= 0."""
    turn_scale: float = 0.3
    """Cost of a frontier per radian that the robot must turn towards it, >= 0."""
    keep_goal_m: float = 1.0
    """Advantage of the present goal over others, metres of way, >= 0. Less: robots dither."""
    progress_timeout_s: float = 15.0
    """A goal that has come no nearer for so long is given up and blacklisted, seconds, > 0."""
    blacklist_radius_m: float = 0.6
    """Frontiers this near to a blacklisted goal are passed over, metres, > 0."""
    blacklist_forgiven: int = 1
    """How often the blacklist is wiped when nothing else is left, >= 0."""
    stuck_after_s: float = 3.0
    """A robot that should drive but has not moved for so long backs off, seconds, > 0."""
    finish_after_s: float = 6.0
    """Exploration is finished when no frontier was left for so long, seconds, > 0."""
    arrive_m: float = 0.25
    """A waypoint this near is reached, metres, > 0."""

    def __post_init__(self) -> None:
        may_be_zero = ("margin_m", "gain_scale", "turn_scale", "keep_goal_m", "blacklist_forgiven")
        for name, value in vars(self).items():
            least_ok = value >= 0 if name in may_be_zero else value > 0
            require(least_ok, f"driver.{name}", ">= 0" if name in may_be_zero else "> 0", value)
