"""Driving along a path, and stopping before what stands in the way."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.drivers.base import STOP, Command
from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

TURN_FIRST_RAD = 0.9
"""Beyond this heading error the robot turns on the spot."""
BRAKE_M_S2 = 0.6
"""Deceleration that the approach to an obstacle counts on."""


def steer(T_map_base: Transform, path_m: NDArray[np.float64], config: DriverConfig) -> Command:
    """Return the command that follows a path ``(N, 2)`` in the map frame: pure pursuit (Coulter 1992)."""
    if len(path_m) == 0:
        return STOP
    gaps = np.hypot(path_m[:, 0] - T_map_base[0], path_m[:, 1] - T_map_base[1])
    nearest = int(np.argmin(gaps))
    ahead = np.flatnonzero(gaps[nearest:] >= config.look_ahead_m)
    target = path_m[nearest + int(ahead[0])] if ahead.size else path_m[-1]
    return steer_at(T_map_base, target, float(np.hypot(*(path_m[-1] - T_map_base[:2]))), config)


def steer_at(T_map_base: Transform, target_m: NDArray[np.float64], distance_m: float, config: DriverConfig) -> Command:
    """Return the command that drives at a point, slowing over the last ``distance_m`` to the end of the way."""
    dx, dy = target_m[0] - T_map_base[0], target_m[1] - T_map_base[1]
    reach = math.hypot(dx, dy)
    if reach < 0.02:
        return STOP
    error = float(se2.wrap(math.atan2(dy, dx) - T_map_base[2]))
    if abs(error) > TURN_FIRST_RAD:
        return 0.0, math.copysign(config.turn_rad_s, error)
    speed = min(config.speed_m_s * math.cos(error) ** 2, 0.1 + distance_m)
    turn = 2.0 * speed * math.sin(error) / max(reach, 0.5 * config.look_ahead_m) + 0.5 * error
    return speed, min(max(turn, -config.turn_rad_s), config.turn_rad_s)


def slow_for_obstacles(command: Command, scan: Scan | None, config: DriverConfig) -> Command:
    """Return the command with its speed cut so that the robot stops before what the scan shows ahead of it."""
    speed, turn = command
    if scan is None or speed <= 0.0:
        return command
    points = scan.points_base()
    body = config.robot_radius_m
    x, y = points[:, 0], points[:, 1]
    beside = (np.abs(y) < body + 0.02) & (x > 0.3 * body)
    if not beside.any():
        return command
    front = x[beside] - np.sqrt(np.maximum(body**2 - y[beside] ** 2, 0.0))
    gap = max(float(front.min()) - 0.04, 0.0)
    return min(speed, math.sqrt(2.0 * BRAKE_M_S2 * gap)), turn
