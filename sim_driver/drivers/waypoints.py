"""Driving to given places, one after the other, and following a recorded trajectory."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from mrslam.sim_driver.drivers.base import STOP, Command
from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.sim_driver.drivers.costmap import make_costmap
from mrslam.sim_driver.drivers.follow import slow_for_obstacles, steer, steer_at
from mrslam.sim_driver.drivers.plan import path_between, seen_obstacles, surrounded
from mrslam.sim_driver.drivers.recovery import Recovery
from mrslam.spatial import InputError, OccupancyGrid, Scan
from mrslam.spatial.se2 import Transform

NS = 1_000_000_000
AROUND_M = 1.0
"""Width of the unknown that is planned through around a map, metres: room for a robot."""


class WaypointDriver:
    """Drives to each waypoint by A* on the map, where that shows no way through what it does not know, or straight."""

    def __init__(
        self, waypoints_m: ArrayLike, config: DriverConfig | None = None, seed: int = 0, loop: bool = False
    ) -> None:
        """``waypoints_m`` : ``(N, 2)`` in the robot's map frame (its start pose is the origin)."""
        self._waypoints_m = np.array(waypoints_m, dtype=np.float64)
        if (
            self._waypoints_m.ndim != 2
            or self._waypoints_m.shape[1:] != (2,)
            or not np.isfinite(self._waypoints_m).all()
        ):
            raise InputError(f"waypoints must be a list of [x, y] in metres, got shape {self._waypoints_m.shape}")
        self._config, self._loop = config or DriverConfig(), loop
        self._recovery = Recovery(self._config, np.random.default_rng(seed))
        self._at, self._next_plan_ns = 0, 0
        self._path_m: NDArray[np.float64] | None = None

    @property
    def finished(self) -> bool:
        """Whether the last waypoint was reached."""
        return self._at >= len(self._waypoints_m)

    def command(
        self,
        now_ns: int,
        T_map_base: Transform,
        grid: OccupancyGrid | None,
        teammates: Mapping[str, Transform],
        scan: Scan | None = None,
    ) -> Command:
        """See :class:`mrslam.sim_driver.drivers.Driver`."""
        if not self.finished and np.hypot(*(self._waypoints_m[self._at] - T_map_base[:2])) < self._config.arrive_m:
            self._at, self._next_plan_ns = self._at + 1, now_ns
            if self._loop:
                self._at %= len(self._waypoints_m)
        if self.finished:
            return STOP
        escape = self._recovery.command(now_ns)
        if escape is not None:
            return escape
        goal = self._waypoints_m[self._at]
        if now_ns >= self._next_plan_ns:
            self._next_plan_ns = now_ns + round(self._config.plan_interval_s * NS)
            mates = np.array([teammates[name][:2] for name in sorted(teammates)]).reshape(-1, 2)
            self._path_m = self._plan(grid, T_map_base, goal, mates, scan)
        if self._recovery.is_stuck(now_ns, T_map_base):
            self._next_plan_ns = now_ns
            return self._recovery.start(now_ns)
        if self._path_m is None:
            wanted = steer_at(T_map_base, goal, float(np.hypot(*(goal - T_map_base[:2]))), self._config)
        else:
            wanted = steer(T_map_base, np.concatenate([self._path_m, goal[None]]), self._config)
        return slow_for_obstacles(wanted, scan, self._config)

    def _plan(
        self,
        grid: OccupancyGrid | None,
        T_map_base: Transform,
        goal: NDArray[np.float64],
        mates: NDArray[np.float64],
        scan: Scan | None,
    ) -> NDArray[np.float64] | None:
        """Return a path ``(N, 2)`` to the goal, or to where it leaves the map; None where there is none."""
        if grid is None or not grid.cells.size:
            return None
        seen = seen_obstacles(scan, T_map_base, mates, self._config)
        costmap = make_costmap(grid, self._config, seen, mates)
        path = path_between(costmap, T_map_base[:2], goal, self._config.arrive_m)
        if path is None:
            around = surrounded(grid, AROUND_M)
            costmap = make_costmap(around, self._config, seen, mates, through_unknown=True)
            path = path_between(costmap, T_map_base[:2], costmap.inside(goal))
        return path if path is not None and len(path) > 1 else None  # where it is one point, that was reached


class TrajectoryDriver:
    """Drives where a recorded robot was at each time, as fast as the drive allows."""

    def __init__(self, stamps_ns: ArrayLike, T_map_base: ArrayLike, config: DriverConfig | None = None) -> None:
        """``stamps_ns`` : ``(N,)``, rising; ``T_map_base`` : ``(N, 3)`` in this robot's map frame.

        The recording starts at the first call.
        """
        self._stamps_ns = np.array(stamps_ns, dtype=np.int64)
        self._xy_m = np.array(T_map_base, dtype=np.float64)
        if self._stamps_ns.ndim != 1 or self._stamps_ns.size == 0 or self._xy_m.shape != (self._stamps_ns.size, 3):
            raise InputError(
                f"a trajectory needs N stamps and (N, 3) poses, got {self._stamps_ns.shape}, {self._xy_m.shape}"
            )
        if (np.diff(self._stamps_ns) < 0).any():
            raise InputError("a trajectory's stamps must not run backward")
        self._config = config or DriverConfig()
        self._start_ns: int | None = None
        self._finished = False

    @property
    def finished(self) -> bool:
        """Whether the recording's end was reached, in time and place."""
        return self._finished

    def command(
        self,
        now_ns: int,
        T_map_base: Transform,
        grid: OccupancyGrid | None,
        teammates: Mapping[str, Transform],
        scan: Scan | None = None,
    ) -> Command:
        """See :class:`mrslam.sim_driver.drivers.Driver`; steers at where the recording is a second from now."""
        if self._start_ns is None:
            self._start_ns = now_ns
        elapsed = self._stamps_ns[0] + (now_ns - self._start_ns)
        target = np.array([np.interp(elapsed + NS, self._stamps_ns, self._xy_m[:, axis]) for axis in (0, 1)])
        distance = float(np.hypot(*(target - T_map_base[:2])))
        if distance < self._config.arrive_m and elapsed >= self._stamps_ns[-1]:
            self._finished = True
        if self._finished or distance < 0.05:
            return STOP
        speed, turn = steer_at(T_map_base, target, distance, self._config)
        return slow_for_obstacles((min(speed, distance), turn), scan, self._config)


class IdleDriver:
    """Stays where it is."""

    finished = True

    def command(
        self,
        now_ns: int,
        T_map_base: Transform,
        grid: OccupancyGrid | None,
        teammates: Mapping[str, Transform],
        scan: Scan | None = None,
    ) -> Command:
        """See :class:`mrslam.sim_driver.drivers.Driver`."""
        return STOP
