"""The truth of a simulated mission: one world, all robots in it, and the radio between them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Collection, Mapping
from itertools import combinations
from pathlib import Path

import numpy as np

from mrslam.agent import Sensed
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import LINKS_FILE, TRUTH_FILE
from mrslam.sim_driver.missions.sections import RobotConfig
from mrslam.sim_driver.missions.seeds import seed_for
from mrslam.sim_driver.robots import LASERS, ChassisConfig, Fleet, LaserModel, SimulatedRobot, Walkers
from mrslam.sim_driver.worlds import World, load_world
from mrslam.sim_driver.worlds.radio import Radio
from mrslam.spatial import InputError
from mrslam.spatial.errors import require
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.tum import read_tum, write_tum
from mrslam.spatial.runtime.spool import Spool
from mrslam.spatial.se2 import Transform

STEP_NS = 100_000_000
"""Time between two sweeps of every laser, nanoseconds."""


class Simulation:
    """Steps ten times a second of mission time; robots' commands hold until the next step."""

    def __init__(self, mission: Mission) -> None:
        """Place the robots; their starts follow from the mission's seed unless it gives them."""
        assert mission.world is not None
        self.robots = [robot for robot in mission.robots if is_simulated(mission, robot)]
        self.world = make_world(mission)
        self.radio = Radio(self.world, mission.radio, seed_for(mission, "radio"))
        rng = np.random.default_rng(seed_for(mission, "simulation"))
        placed = self._placed(mission, rng)
        crowd = np.random.default_rng(seed_for(mission, "walkers"))
        people = Walkers(self.world, mission.world.walkers, crowd) if mission.world.walkers else None
        self.fleet = Fleet(placed, people)
        self.starts = self.fleet.T_world_base()
        self.commands: dict[str, tuple[float, float]] = {}
        """By robot: what it drives from now on, speed (m/s) and turn (rad/s)."""
        self.sensing: Collection[str] = self.fleet.robots.keys()
        """The robots whose lasers are needed: all, unless others play some of them."""
        self._sensed: dict[str, list[Sensed]] = defaultdict(list)
        self._qualities: dict[str, dict[str, float]] = {}
        self._pairs = list(combinations(sorted(self.fleet.robots), 2))
        place_of = {robot_id: k for k, robot_id in enumerate(self.fleet.robots)}
        self._pair_places = np.array([[place_of[a], place_of[b]] for a, b in self._pairs]).reshape(-1, 2)
        columns = 1 + 3 * len(self.fleet.robots) + len(self._pairs)  # time, poses, qualities of links
        self._truth = Spool((np.float64, columns))
        self._next_ns = 0

    def _placed(self, mission: Mission, rng: np.random.Generator) -> dict[str, SimulatedRobot]:
        given = {robot.id: start for robot in self.robots if (start := start_of(mission, robot)) is not None}
        self._check_starts(given)
        for robot in self.robots:
            if robot.driver == "waypoints" and robot.id in given:
                self._check_waypoints(robot, given[robot.id])
        placed: dict[str, SimulatedRobot] = {}
        for robot in self.robots:
            start = given.get(robot.id)
            if start is None:
                others = [*(other.T_world_base for other in placed.values()), *_not_yet(given, placed)]
                taken = np.array([T_world_base[:2] for T_world_base in others]).reshape(-1, 2)
                start = self.world.free_start(rng, apart_from=taken)
            placed[robot.id] = SimulatedRobot(self.world, start, _laser(robot), rng.spawn(1)[0])
        return placed

    def _check_starts(self, given: Mapping[str, Transform]) -> None:
        """Refuse starts that are no floor of the world, and two in one place."""
        apart_m = 2.0 * ChassisConfig().radius_m
        for robot_id, (x, y, _) in given.items():
            self._check_floor(robot_id, "start", x, y)
        for (a, T_world_a), (b, T_world_b) in combinations(given.items(), 2):
            gap_m = float(np.hypot(*(T_world_a - T_world_b)[:2]))
            if gap_m < apart_m:
                raise InputError(
                    f"robots {a} and {b} start {gap_m:g} m apart, one in the other; keep them {apart_m:g} m apart"
                )

    def _check_waypoints(self, robot: RobotConfig, start: Transform) -> None:
        """Refuse waypoints that are no floor of the world, or that no floor joins to the start: none is reached."""
        for x, y in robot.waypoints:
            self._check_floor(robot.id, "waypoint", x, y)
            if not self.world.is_joined(start[:2], np.array([x, y])):
                raise InputError(f"robot {robot.id}: no floor leads from its start to the waypoint {x:g}, {y:g}")

    def _check_floor(self, robot_id: str, what: str, x: float, y: float) -> None:
        if not self.world.clearance_m(np.array([x, y])) > 0.0:
            (x0, y0), (width, height) = self.world.grid.origin_m, self.world.size_m
            raise InputError(
                f"robot {robot_id}: {what} {x:g}, {y:g} is no floor of the world {self.world.name}, "
                f"which has x from {x0:g} to {x0 + width:g} m and y from {y0:g} to {y0 + height:g} m"
            )

    def advance(self, now_ns: int) -> None:
        """Move the world on to this mission time."""
        while self._next_ns <= now_ns:
            if self._next_ns > 0:
                self.fleet.step(self.commands, STEP_NS / 1e9)
            for seen in self.fleet.observe(self._next_ns, self.sensing):
                self._sensed[seen.robot_id].append(Sensed(self._next_ns, seen.scan, seen.T_odom_base))
            self._hear()
            self._next_ns += STEP_NS

    def kidnap(self, robot_id: str, distance_m: float, rng: np.random.Generator) -> None:
        """Put a robot down elsewhere, about so far away and turned; neither its wheels nor anyone else tell it."""
        robot = self.fleet.robots[robot_id]
        others = [other.T_world_base[:2] for name, other in self.fleet.robots.items() if name != robot_id]
        places = [self.world.free_start(rng, apart_from=np.array(others).reshape(-1, 2)) for _ in range(30)]
        robot.T_world_base = min(
            places, key=lambda place: abs(float(np.hypot(*(place - robot.T_world_base)[:2])) - distance_m)
        )

    def _hear(self) -> None:
        poses = self.fleet.T_world_base()
        self._qualities = {robot_id: {} for robot_id in poses}
        places_m = np.array([pose[:2] for pose in poses.values()]).reshape(-1, 2)
        heard = self.radio.qualities(places_m, self._pair_places) if self._pairs else []
        for (a, b), quality in zip(self._pairs, heard, strict=True):
            self._qualities[a][b] = self._qualities[b][a] = quality
        self._truth.add(np.concatenate([[self._next_ns], *poses.values(), heard]))

    def take(self, robot_id: str) -> list[Sensed]:
        """Return the robot's scans since the last call."""
        return self._sensed.pop(robot_id, [])

    def command(self, robot_id: str, command: tuple[float, float]) -> None:
        """Set what a robot drives from now on: speed (m/s) and turn (rad/s)."""
        self.commands[robot_id] = command

    def qualities(self, robot_id: str) -> dict[str, float]:
        """Return the true quality of the robot's links, now."""
        return self._qualities.get(robot_id, {})

    def write_truth(self, out: Path) -> None:
        """Write the links' true qualities, and true trajectories in the world frame (``<id>/truth.tum``)."""
        rows = self._truth.rows
        stamps, robots = rows[:, 0].astype(np.int64), list(self.fleet.robots)
        heard = rows[:, 1 + 3 * len(robots) :]
        lines = (
            f"{t_ns / 1e9!r},{a},{b},{quality!r}"
            for t_ns, row in zip(stamps.tolist(), heard.tolist(), strict=True)
            for (a, b), quality in zip(self._pairs, row, strict=True)
        )
        write_text(out / LINKS_FILE, "\n".join(("t_s,a,b,quality", *lines)) + "\n")
        for k, robot_id in enumerate(robots):
            write_tum(out / robot_id / TRUTH_FILE, stamps, rows[:, 1 + 3 * k : 4 + 3 * k])


def _not_yet(given: Mapping[str, Transform], placed: Mapping[str, SimulatedRobot]) -> list[Transform]:
    """Return the given starts of robots that are not placed yet."""
    return [start for robot_id, start in given.items() if robot_id not in placed]


def is_simulated(mission: Mission, robot: RobotConfig) -> bool:
    """Return whether a robot drives in the mission's world."""
    return mission.world is not None and robot.log is None and robot.mode != "central"


def start_of(mission: Mission, robot: RobotConfig) -> Transform | None:
    """Return where the mission says that a robot starts, ``T_world_base``; None where chance decides."""
    if robot.start is not None:
        return np.array(robot.start, dtype=np.float64)
    if robot.driver == "trajectory" and robot.trajectory is not None:
        poses = read_tum(mission.find(robot.trajectory))[1]
        require(len(poses) > 0, f"robots.{robot.id}.trajectory", "a TUM file with poses", robot.trajectory)
        return poses[0]
    return None


def make_world(mission: Mission) -> World:
    """Return the world of a simulated mission."""
    assert mission.world is not None
    name, scale_m = mission.world.name, mission.world.scale_m
    try:
        return load_world(name, scale_m)
    except InputError as error:
        try:
            path = mission.find(name)
        except InputError:
            raise error from None  # it names the built-in worlds
        return load_world(path, scale_m)


def _laser(robot: RobotConfig) -> LaserModel:
    if robot.laser not in LASERS:
        raise InputError(f"robot {robot.id}: no laser {robot.laser!r}; there are {', '.join(LASERS)}")
    return LASERS[robot.laser]
