"""Simulated robots: drive, odometry, lasers, and how they see and block each other."""

from mrslam.sim_driver.robots.config import ChassisConfig, OdometryConfig
from mrslam.sim_driver.robots.fleet import Fleet, Observation
from mrslam.sim_driver.robots.lasers import LASERS, LaserModel
from mrslam.sim_driver.robots.robot import NOBODY, SimulatedRobot
from mrslam.sim_driver.robots.walkers import Walkers
from mrslam.sim_driver.robots.warm_up import warm_up

__all__ = [
    "LASERS",
    "NOBODY",
    "ChassisConfig",
    "Fleet",
    "LaserModel",
    "Observation",
    "OdometryConfig",
    "SimulatedRobot",
    "Walkers",
    "warm_up",
]
