"""Compiles the kernels of robots and radio ahead of use."""

from __future__ import annotations

import numpy as np

from mrslam.sim_driver.robots.lasers import LASERS
from mrslam.sim_driver.robots.robot import SimulatedRobot
from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.sim_driver.worlds.radio import Radio
from mrslam.sim_driver.worlds.world import World


def warm_up() -> None:
    """Call each kernel once."""
    world = World("warm-up", Canvas(1.0, 1.0).grid())
    robot = SimulatedRobot(world, np.array([0.5, 0.5, 0.0]), LASERS["lidar-360"], np.random.default_rng(0))
    robot.scan(0, (np.array([[0.7, 0.7]]), np.array([0.1])))
    Radio(world).quality((0.3, 0.3), (0.6, 0.6))
