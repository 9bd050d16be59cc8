"""Simulated robots: drive, odometry, lasers, and how they see and block each other."""

import spatial  # noqa: F401 - points numba's cache at the right folder before any kernel is defined
from sim_driver.robots.config import ChassisConfig, OdometryConfig
from sim_driver.robots.fleet import Fleet, Observation
from sim_driver.robots.lasers import LASERS, LaserModel
from sim_driver.robots.robot import NOBODY, SimulatedRobot
from sim_driver.robots.warm_up import warm_up

__all__ = [
    "LASERS",
    "NOBODY",
    "ChassisConfig",
    "Fleet",
    "LaserModel",
    "Observation",
    "OdometryConfig",
    "SimulatedRobot",
    "warm_up",
]
