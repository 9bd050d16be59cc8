"""A run's folder, read: what each robot left, its events, and the truth where the simulator wrote it."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.trajectories import Trajectory, fit
from mrslam.sim_driver.evaluate.truth import true_starts, true_trajectories
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import TRAJECTORY_FILE
from mrslam.sim_driver.missions.run_folder import Event, read_events, read_metrics, read_robots
from mrslam.sim_driver.replay.again import mission_of
from mrslam.sim_driver.robots import LASERS
from mrslam.spatial import OccupancyGrid, read_map, se2
from mrslam.spatial.files.tum import read_tum
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, eq=False)
class RunResults:
    """What a run left; a robot that was lost has events only."""

    folder: Path
    mission: Mission
    metrics: dict[str, Any]
    robots: dict[str, dict[str, Any]]
    """``robot.json`` of every robot that ended in good order, by id."""

    @classmethod
    def read(cls, folder: Path) -> RunResults:
        """Read a run's folder; raise ``InputError`` where it is none or the run has not ended."""
        mission = mission_of(folder)
        robots = read_robots(folder, (robot.id for robot in mission.robots))
        return cls(folder, mission, read_metrics(folder), robots)

    @cached_property
    def events(self) -> dict[str, list[Event]]:
        """Events of every robot in the order they were written; lines that a crash cut off are left out."""
        return {robot.id: read_events(self.folder / robot.id) for robot in self.mission.robots}

    @cached_property
    def truth(self) -> dict[str, Trajectory]:
        """True poses of the bases of simulated robots in the world frame, by id."""
        return true_trajectories(self.mission, self.folder)

    @cached_property
    def T_world_map(self) -> dict[str, Transform]:
        """Where simulated robots' maps truly lie."""
        return true_starts(self.truth, self.folder)

    @cached_property
    def T_world_way(self) -> dict[str, Transform]:
        """Where simulated robots' maps lie by all their poses: maps are bent a little from their first scan on."""
        truth = {robot: self.laser_truth(robot) for robot in self.robots}
        ways = {robot: fit(self.trajectory(robot), way) for robot, way in truth.items() if way is not None}
        return {robot: T_world_map for robot, T_world_map in ways.items() if T_world_map is not None}

    @cached_property
    def map_begun_s(self) -> dict[str, float]:
        """Mission time of the first scan of each simulated robot's map: later than its start if it began a new one."""
        first_ns = {robot: self.trajectory(robot)[0][:1].tolist() for robot in self.truth.keys() & self.robots.keys()}
        return {robot: stamps[0] / 1e9 for robot, stamps in first_ns.items() if stamps}

    def began_s(self, robot_id: str) -> float:
        """Return the mission time of a recorded robot's first scan: agents on their own began when they did."""
        return float(self.metrics.get("began_s", {}).get(robot_id, 0.0))

    def laser_truth(self, robot_id: str) -> Trajectory | None:
        """Return the true poses of a simulated robot's laser."""
        if robot_id not in self.truth:
            return None
        (laser,) = (LASERS[robot.laser] for robot in self.mission.robots if robot.id == robot_id)
        stamps, poses = self.truth[robot_id]
        return stamps, se2.compose(poses, np.array(laser.T_base_laser))

    def trajectory(self, robot_id: str) -> Trajectory:
        """Return the poses of a robot's laser in its own map."""
        return read_tum(self.folder / robot_id / TRAJECTORY_FILE)

    def map(self, robot_id: str, name: str = "map") -> OccupancyGrid:
        """Return a robot's own map, or its ``team_map`` (in its own map's frame, too)."""
        return read_map(self.folder / robot_id / f"{name}.yaml")
