"""Settings of the drivers."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.spatial.errors import require_bounds

LONGEST_S, FARTHEST_M = 1e6, 1e6
"""Bounds of times (11 days) and distances: larger ones mean never and nowhere, and no sum with them loses a second."""
BOUNDS = {
    "robot_radius_m": (0.01, 10.0), "margin_m": (0.0, 10.0), "comfort_m": (0.001, 100.0), "speed_m_s": (0.001, 100.0),
    "turn_rad_s": (0.001, 100.0), "look_ahead_m": (0.01, 100.0), "plan_resolution_m": (0.005, 10.0),
    "max_plan_cells": (100, 100_000_000), "plan_interval_s": (0.05, LONGEST_S), "min_frontier_m": (0.001, FARTHEST_M),
    "path_scale": (0.001, 1e3), "gain_scale": (0.0, 1e3), "turn_scale": (0.0, 1e3), "keep_goal_m": (0.0, FARTHEST_M),
    "progress_timeout_s": (0.1, LONGEST_S), "blacklist_radius_m": (0.001, FARTHEST_M), "blacklist_forgiven": (0, 1000),
    "stuck_after_s": (0.1, LONGEST_S), "finish_after_s": (0.1, LONGEST_S), "arrive_m": (0.01, 100.0),
}  # fmt: skip
"""Least and largest value of every setting."""


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
    max_plan_cells: int = 250_000
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
        require_bounds("driver", self, BOUNDS)
