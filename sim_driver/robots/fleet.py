"""Several robots in one world, each an obstacle and a moving disc to the others."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.robots.robot import SimulatedRobot
from mrslam.sim_driver.robots.walkers import Walkers
from mrslam.spatial import Scan
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, eq=False)
class Observation:
    """What one robot's sensors give at one instant."""

    robot_id: str
    scan: Scan
    T_odom_base: Transform
    """``(3,)`` raw odometry from the start pose."""
    T_world_base: Transform
    """``(3,)`` truth, for evaluation and the radio only."""


class Fleet:
    """Steps robots together, in the order of their ids."""

    def __init__(self, robots: Mapping[str, SimulatedRobot], walkers: Walkers | None = None) -> None:
        """Take robots that are already placed in one world, and the people in it."""
        self.robots = {robot_id: robots[robot_id] for robot_id in sorted(robots)}
        self.walkers = walkers

    def T_world_base(self) -> dict[str, Transform]:
        """Return every robot's true pose."""
        return {robot_id: robot.T_world_base for robot_id, robot in self.robots.items()}

    def step(self, commands: Mapping[str, tuple[float, float]], dt_s: float = 0.1) -> None:
        """Drive every robot for ``dt_s`` by its (speed m/s, turn rad/s); those without a command brake."""
        for robot_id, robot in self.robots.items():
            robot.step(commands.get(robot_id, (0.0, 0.0)), dt_s, self._others(robot_id))
        if self.walkers is not None:
            self.walkers.step(np.array([robot.T_world_base[:2] for robot in self.robots.values()]), dt_s)

    def observe(self, stamp_ns: int, of: Collection[str] | None = None) -> list[Observation]:
        """Return every robot's sensors at this instant, or those ``of`` some robots: each has noise of its own."""
        return [self.observe_one(robot_id, stamp_ns) for robot_id in self.robots if of is None or robot_id in of]

    def observe_one(self, robot_id: str, stamp_ns: int) -> Observation:
        """Return one robot's sensors (its laser's noise moves on with each call)."""
        robot = self.robots[robot_id]
        scan = robot.scan(stamp_ns, self._others(robot_id))
        return Observation(robot_id, scan, robot.T_odom_base, robot.T_world_base)

    def _others(self, robot_id: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        others = [robot for other, robot in self.robots.items() if other != robot_id]
        centres = np.array([robot.T_world_base[:2] for robot in others]).reshape(-1, 2)
        radii = np.array([robot.config.radius_m for robot in others], dtype=np.float64)
        if self.walkers is None:
            return centres, radii
        return np.concatenate([centres, self.walkers.places_m]), np.concatenate([radii, self.walkers.radii_m])
