"""A run's folder, read: what each robot left, its events, and the truth where the simulator wrote it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from mrslam.sim_driver.evaluate.lost import map_begun_s, pairs_by_events
from mrslam.sim_driver.evaluate.trajectories import Trajectory, fit
from mrslam.sim_driver.faults.clock import mission_times_s
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import (
    METRICS_FILE,
    ROBOT_FILE,
    TRAJECTORY_FILE,
    TRUTH_FILE,
    USAGE_FILE,
    team_file,
)
from mrslam.sim_driver.missions.run_folder import Event, read_events, read_metrics, read_robot, read_table
from mrslam.sim_driver.missions.run_shapes import UsageFile
from mrslam.sim_driver.replay.again import mission_of
from mrslam.sim_driver.robots import LASERS
from mrslam.spatial import InputError, OccupancyGrid, read_map, se2
from mrslam.spatial.files.tum import read_tum
from mrslam.spatial.se2 import Transform

T = TypeVar("T")
NO_POSES: Trajectory = (np.empty(0, dtype=np.int64), np.empty((0, 3)))
"""Stands in for a trajectory whose file is damaged."""


@dataclass(frozen=True, eq=False)
class RunResults:
    """What a run left; a robot that was lost, or whose ``robot.json`` is damaged, has events only."""

    folder: Path
    mission: Mission
    metrics: dict[str, Any]
    robots: dict[str, dict[str, Any]]
    """``robot.json`` of every robot that ended in good order, by id."""
    damage: list[str] = field(default_factory=list)
    """Files that were found damaged so far, a line each; the results are those of all the others."""
    _kept: dict[Path, Any] = field(default_factory=dict)

    @classmethod
    def read(cls, folder: Path) -> RunResults:
        """Read a run's folder; raise ``InputError`` where it is none or the run has not ended."""
        mission = mission_of(folder)
        if not (folder / METRICS_FILE).exists():
            read_metrics(folder)
        run = cls.of(mission, folder)
        run.metrics.update(run._metrics())
        return run

    @classmethod
    def of(cls, mission: Mission, folder: Path) -> RunResults:
        """Return what a mission's robots have left in the folder, without the metrics of the run."""
        run = cls(folder, mission, {}, {})
        for robot_id in sorted(robot.id for robot in mission.robots):
            if (folder / robot_id / ROBOT_FILE).exists():
                robot = run.tried(folder / robot_id / ROBOT_FILE, _robot, None)
                run.robots.update({} if robot is None else {robot_id: robot})
        for robot_id in {fault.robot for fault in mission.faults if fault.kind == "clock"} & run.robots.keys():
            run._set_right(robot_id)
        return run

    def _set_right(self, robot_id: str) -> None:
        """Give merges of a robot whose clock was made to jump their mission times: those of their events."""
        merged_s = {(one["a"], one["b"]): one["t"] for one in self.events[robot_id] if one["event"] == "merged"}
        for pair in self.robots[robot_id]["pairs"]:
            if pair["accepted_at_s"] is not None:
                shown_s = max(pair["accepted_at_s"], 0.0)
                pair["accepted_at_s"] = round(merged_s.get((pair["a"], pair["b"]), shown_s), 3)

    def _metrics(self) -> dict[str, Any]:
        """Return ``metrics.json``; where it is damaged, what the robots' files say in its place."""
        metrics = self.tried(self.folder / METRICS_FILE, lambda path: _table(read_metrics(path.parent)), None)
        if metrics is not None:
            return metrics
        return {
            "name": self.mission.mission.name,
            "mission_s": max((event["t"] for events in self.events.values() for event in events), default=0.0),
            "links": [link_totals(self.robots, a, b) for a, b in combinations(sorted(self.robots), 2)],
            "robots_lost": self.robots_lost,
        }

    def tried(self, path: Path, reader: Callable[[Path], T], otherwise: T, *, keep: bool = True) -> T:
        """Return what the reader makes of a path; where it is damaged or gone, note that once and return the other.

        It is read once, unless ``keep`` is False: for what is large and needed once.
        """
        if path in self._kept:
            kept: T = self._kept[path]
            return kept
        try:
            found = reader(path)
        except (InputError, OSError) as error:
            self.damage.append(str(error))
            found, keep = otherwise, True
        if keep:
            self._kept[path] = found
        return found

    @property
    def robots_lost(self) -> list[str]:
        """Robots without a readable ``robot.json``, in the mission's order."""
        return [robot.id for robot in self.mission.robots if robot.id not in self.robots]

    @cached_property
    def events(self) -> dict[str, list[Event]]:
        """Events of every robot in the order they were written; lines that a crash cut off are left out.

        At mission times, also of a robot whose clock was made to jump.
        """
        found = {}
        for robot in self.mission.robots:
            read = read_events(self.folder / robot.id)
            faults = [fault for fault in self.mission.faults if fault.robot == robot.id]
            times_s = mission_times_s(faults, [event["t"] for event in read.events])
            found[robot.id] = [{**event, "t": t_s} for event, t_s in zip(read.events, times_s, strict=True)]
            self.damage.extend([read.damage] if read.damage else [])
        return found

    @cached_property
    def beliefs(self) -> dict[str, dict[str, Any]]:
        """By robot: its ``mode`` and ``pairs``; of one without a readable ``robot.json`` by its events."""
        lost = {
            robot.id: {"mode": robot.mode, "pairs": pairs_by_events(self.events[robot.id])}
            for robot in self.mission.robots
            if robot.id in self.robots_lost
        }
        return {**self.robots, **lost}

    @cached_property
    def truth(self) -> dict[str, Trajectory]:
        """True poses of the bases of simulated robots in the world frame, by id."""
        paths = {robot.id: self.folder / robot.id / TRUTH_FILE for robot in self.mission.robots}
        found = {robot: self.tried(path, read_tum, NO_POSES) for robot, path in paths.items() if path.exists()}
        return {robot: poses for robot, poses in found.items() if poses is not NO_POSES}

    @cached_property
    def T_world_map(self) -> dict[str, Transform]:
        """Where simulated robots' maps truly lie: a map's frame is its robot's pose at the map's first scan.

        That is not where it set out if it gave its map up, or lost it, and began a new one.
        """
        found = {}
        for robot_id, (stamps_ns, poses) in self.truth.items():
            mapped = (self.folder / robot_id / TRAJECTORY_FILE).exists()
            begun_ns = np.array([round(map_begun_s(self.events[robot_id]) * 1e9)])
            first_ns = self.trajectory(robot_id)[0][:1] if mapped else begun_ns
            if len(poses):
                found[robot_id] = poses[int(np.abs(stamps_ns - first_ns).argmin()) if first_ns.size else 0]
        return found

    @cached_property
    def T_world_way(self) -> dict[str, Transform]:
        """Where simulated robots' maps lie by all their poses: maps are bent a little from their first scan on."""
        truth = {robot: self.laser_truth(robot) for robot in self.robots}
        ways = {robot: fit(self.trajectory(robot), way) for robot, way in truth.items() if way is not None}
        return {robot: T_world_map for robot, T_world_map in ways.items() if T_world_map is not None}

    def team_frames(self, places: Mapping[str, Transform]) -> dict[str, Transform]:
        """Return where robots' team maps lie, from where maps do: a base station's lies in another robot's frame."""
        frames = {robot_id: robot.get("frame") or robot_id for robot_id, robot in self.robots.items()}
        return {robot_id: places[frame] for robot_id, frame in frames.items() if frame in places}

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
        """Return the poses of a robot's laser in its own map; none where the file is damaged."""
        path = self.folder / robot_id / TRAJECTORY_FILE
        return NO_POSES if self._left_none(path) else self.tried(path, read_tum, NO_POSES)

    def team_trajectories(self, robot_id: str) -> dict[str, Trajectory]:
        """Return the poses of every placed robot's laser in a robot's team frame, corrected where its map is bent."""
        ways = {}
        for other, T_team_map in self.robots[robot_id]["placed"].items():
            corrected = self.folder / robot_id / team_file(other)
            if corrected.exists():
                ways[other] = self.tried(corrected, read_tum, NO_POSES)
            elif other in self.robots:
                stamps_ns, T_map_laser = self.trajectory(other)
                ways[other] = stamps_ns, se2.compose(np.array(T_team_map), T_map_laser)
        return {other: way for other, way in ways.items() if len(way[0])}

    def picture(self, robot_id: str, name: str) -> bytes | None:
        """Return a PNG file of a robot; None where there is none, or it is damaged."""
        path = self.folder / robot_id / name
        return self.tried(path, _png, None) if path.exists() else None

    def map(self, robot_id: str, name: str = "map", *, keep: bool = True) -> OccupancyGrid | None:
        """Return a robot's own map, or its ``team_map`` (in its own map's frame, too); None where it is damaged.

        ``keep`` : see :meth:`tried`.
        """
        path = self.folder / robot_id / f"{name}.yaml"
        return None if self._left_none(path) else self.tried(path, _map, None, keep=keep)

    def _left_none(self, path: Path) -> bool:
        """Return whether a robot that was lost left no such file, which is no damage."""
        return path.parent.name in self.robots_lost and not path.exists()

    def usage(self, robot_id: str) -> dict[str, Any] | None:
        """Return what a robot's process took of the machine; None in virtual time, or where the file is damaged."""
        path = self.folder / robot_id / USAGE_FILE
        return self.tried(path, _usage, None) if path.exists() else None


def _table(table: dict[str, Any]) -> dict[str, Any] | None:
    return table


def _robot(path: Path) -> dict[str, Any] | None:
    robot = read_robot(path.parent)
    if robot is not None and robot["id"] != path.parent.name:
        raise InputError(f"{path}: is {robot['id']}'s, not {path.parent.name}'s")
    return robot


def _map(path: Path) -> OccupancyGrid | None:
    return read_map(path)


def _png(path: Path) -> bytes | None:
    content = path.read_bytes()
    if not (content.startswith(b"\x89PNG\r\n\x1a\n") and content[-8:-4] == b"IEND"):
        raise InputError(f"{path}: empty, cut off or damaged (no whole PNG image)")
    return content


def _usage(path: Path) -> dict[str, Any] | None:
    return read_table(path, UsageFile)


def link_totals(robots: dict[str, dict[str, Any]], a: str, b: str) -> dict[str, Any]:
    """Return what went over a pair's link, both ways, by each robot's ``robot.json``."""
    sides = [link for one, other in ((a, b), (b, a)) for link in robots[one]["links"] if link["peer"] == other]
    return {
        "a": a,
        "b": b,
        "exchanges": max((side["exchanges"] for side in sides), default=0),
        **{key: sum(side[key] for side in sides) for key in ("bytes_sent", "bytes_full_lz4", "bytes_full_raw")},
    }
