"""What decides where a robot goes: waypoints, a recorded trajectory, or frontier exploration."""

from __future__ import annotations

from collections.abc import Callable

from mrslam.sim_driver.drivers.base import STOP, Command, Driver
from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.sim_driver.drivers.explore import Explorer
from mrslam.sim_driver.drivers.warm_up import warm_up
from mrslam.sim_driver.drivers.waypoints import IdleDriver, TrajectoryDriver, WaypointDriver

DRIVERS: dict[str, Callable[..., Driver]] = {
    "explore": Explorer,
    "waypoints": WaypointDriver,
    "trajectory": TrajectoryDriver,
    "idle": IdleDriver,
}
"""Name -> driver. ``Explorer(config, seed)``, ``WaypointDriver(waypoints_m, config, seed, loop)``,
``TrajectoryDriver(stamps_ns, T_map_base, config)``, ``IdleDriver()``."""

__all__ = [
    "DRIVERS",
    "STOP",
    "Command",
    "Driver",
    "DriverConfig",
    "Explorer",
    "IdleDriver",
    "TrajectoryDriver",
    "WaypointDriver",
    "warm_up",
]
