"""A simulated robot's body: senses what the simulation gives, and drives by what the agent knows."""

from __future__ import annotations

from collections import deque
from typing import Protocol

from mrslam.agent import Agent, Sensed
from mrslam.sim_driver.drivers import Driver
from mrslam.sim_driver.simulation.simulation import STEP_NS, Simulation
from mrslam.spatial import OccupancyGrid, Scan

PLAN_NS = 1_500_000_000
"""How often the map that is planned on is made anew, nanoseconds."""


class Port(Protocol):
    """A robot's line to the simulation, in this process or another."""

    def take(self) -> list[Sensed]:
        """Return the scans since the last call."""

    def command(self, command: tuple[float, float]) -> None:
        """Say what to drive: speed (m/s) and turn (rad/s)."""

    def qualities(self) -> dict[str, float]:
        """Return the true quality of the robot's links, now."""


class DirectPort:
    """The line to a simulation in this process."""

    def __init__(self, simulation: Simulation, robot_id: str) -> None:
        """Connect one robot."""
        self._simulation, self._robot_id = simulation, robot_id

    def take(self) -> list[Sensed]:
        """Return the scans since the last call."""
        return self._simulation.take(self._robot_id)

    def command(self, command: tuple[float, float]) -> None:
        """Say what to drive."""
        self._simulation.command(self._robot_id, command)

    def qualities(self) -> dict[str, float]:
        """Return the true quality of the robot's links."""
        return self._simulation.qualities(self._robot_id)


class SimulatedBody:
    """Plays the laser, the wheels and the driver of one simulated robot."""

    def __init__(self, port: Port, driver: Driver) -> None:
        """Take the line to the simulation and what decides where to go."""
        self._port, self._driver = port, driver
        self._waiting: deque[Sensed] = deque()
        self._scan: Scan | None = None
        self._grid: OccupancyGrid | None = None
        self._grid_ns: int | None = None
        self._act_ns = 0

    def sense(self, now_ns: int) -> Sensed | None:
        """Return the next scan that the simulation gave."""
        if not self._waiting:
            self._waiting.extend(self._port.take())
        if not self._waiting:
            return None
        sensed = self._waiting.popleft()
        self._scan = sensed.scan
        return sensed

    def act(self, agent: Agent, now_ns: int) -> None:
        """Drive on, ten times a second."""
        if now_ns < self._act_ns or self._scan is None:
            return
        self._act_ns = now_ns + STEP_NS
        if self._grid_ns is None or now_ns - self._grid_ns >= PLAN_NS:
            self._grid_ns, self._grid = now_ns, agent.planning_grid()
        pose = agent.T_team_base  # in the planning grid
        self._port.command(self._driver.command(now_ns, pose, self._grid, agent.teammates(now_ns), self._scan))

    @property
    def next_ns(self) -> int | None:
        """Not known: scans come when the simulation makes them."""
        return None

    @property
    def finished(self) -> bool:
        """Whether the driver has nothing left to do; the robot stays, and its laser runs on."""
        return self._driver.finished
