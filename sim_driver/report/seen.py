"""When each robot first saw each place: its scans cast from its final trajectory."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

from mrslam.agent import Sensed
from mrslam.sim_driver.evaluate.lost import anew_s
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.trajectories import Trajectory, in_mission_time
from mrslam.sim_driver.feeds import shared_readings
from mrslam.sim_driver.missions.run_files import SCANS_FILE
from mrslam.sim_driver.replay import read_recording
from mrslam.sim_driver.report.cast_kernel import see_along
from mrslam.sim_driver.report.layout import Layout
from mrslam.sim_driver.simulation.recorded import RecordedBody
from mrslam.spatial import Scan, se2

NEVER = np.float32(np.inf)
"""Time of first sight of a place that was never seen."""
STEP_M, STEP_RAD = 0.25, 0.2
"""A scan is cast when the robot has moved or turned this far since the last one cast."""
SIGHT_M = 12.0
"""Beams count as sight up to this length, metres: the beams cast of a full turn are 0.3 m apart there."""
BEAMS = 240
"""Beams of a scan that are cast, about; places between them are filled by :func:`spread`."""


def mission_trajectory(run: RunResults, robot_id: str) -> Trajectory:
    """Return mission times (ns) and laser poses of a robot; scans not simulated have stamps of their own.

    Recorded robots begin at 0 with their first scan, agents that ran on their own when they did; a robot that gave its
    map up when it began the next.
    """
    stamps, poses = run.trajectory(robot_id)
    (robot,) = (robot for robot in run.mission.robots if robot.id == robot_id)
    if robot.log is not None or run.mission.mission.shell == "agents":
        begun_s = anew_s(run.events[robot_id])
        stamps = in_mission_time(stamps, run.began_s(robot_id) if begun_s is None else begun_s)
    return stamps, poses


def first_seen_s(run: RunResults, layout: Layout, robot_id: str) -> NDArray[np.float32]:
    """Return ``(H, W)`` over the layout: mission time (s) at which the robot first saw the place, inf for never.

    Without a recording of its scans, a place counts as seen when the robot first was near it.
    """
    seen: NDArray[np.float32] = np.full(layout.cells.shape, NEVER, dtype=np.float32)
    times_ns, poses = mission_trajectory(run, robot_id)
    if robot_id not in layout.T_plane_map or len(times_ns) == 0:
        return seen
    in_plane = se2.compose(layout.T_plane_map[robot_id], poses)
    scans = _scans(run, robot_id)
    if not scans:
        return _near(layout, times_ns, in_plane)
    at = {stamp_us: i for i, stamp_us in enumerate(_us(run.trajectory(robot_id)[0]).tolist())}
    before = np.full(3, np.inf)
    for one in scans:
        stamp_us = int(_us(one.scan.stamp_ns))
        i = next((at[us] for us in (stamp_us, stamp_us - 1, stamp_us + 1) if us in at), None)
        if i is None:
            continue
        pose = in_plane[i]
        if np.hypot(*(pose - before)[:2]) < STEP_M and abs(se2.wrap(pose[2] - before[2])) < STEP_RAD:
            continue
        before = pose
        cos, sin, reach_m = _beams(one.scan, pose[2])
        see_along(seen, np.float32(one.t_ns / 1e9), pose[:2], cos, sin, reach_m, 2.0 * layout.cell_m, layout.cell_m)
    return seen


def _us(stamps_ns: NDArray[np.int64] | int) -> NDArray[np.int64]:
    """Return stamps in microseconds, as a trajectory's file has them, to one."""
    return np.rint(np.asarray(stamps_ns) / 1e3).astype(np.int64)


def spread(seen: NDArray[np.float32], known: NDArray[np.bool_]) -> NDArray[np.float32]:
    """Return the times with those known places filled in that fell between the beams, from their nearest neighbour."""
    if not np.isfinite(seen).any():
        return seen
    missing = known & ~np.isfinite(seen)
    nearest: Any = ndimage.distance_transform_edt(~np.isfinite(seen), return_distances=False, return_indices=True)
    rows, cols = nearest
    filled = seen.copy()
    filled[missing] = seen[rows[missing], cols[missing]]
    return filled


def _scans(run: RunResults, robot_id: str) -> list[Sensed]:
    """Return what a robot sensed; nothing where that was not kept, or is damaged or gone."""
    (robot,) = (robot for robot in run.mission.robots if robot.id == robot_id)
    if robot.log is not None:
        begin_ns = round(1e9 * run.began_s(robot_id))

        def played(log: Path) -> list[Sensed]:
            readings = shared_readings(run.mission.find(str(log)))
            return list(_all_of(RecordedBody(readings, robot.first, robot.last, begin_ns)))

        return run.tried(Path(robot.log), played, [], keep=False)
    path = (run.mission.replay or run.folder) / robot_id / SCANS_FILE
    return run.tried(path, read_recording, [], keep=False) if path.exists() else []


def _all_of(body: RecordedBody) -> Iterator[Sensed]:
    while body.next_ns is not None:
        sensed = body.sense(body.next_ns)
        assert sensed is not None
        yield sensed


def _beams(scan: Scan, heading_rad: float) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
    """Return the directions (cosines, sines) and the lengths, metres, of the beams that are cast, ``(N,)`` each."""
    every = max(1, scan.ranges_m.size // BEAMS)
    ranges = scan.ranges_m[::every].astype(np.float64)
    angles = scan.angles_rad[::every] + heading_rad
    reach_m = np.minimum(np.where(np.isfinite(ranges), ranges, 0.0), min(scan.range_max_m, SIGHT_M))
    return np.cos(angles), np.sin(angles), reach_m


def _near(layout: Layout, times_ns: NDArray[np.int64], in_plane: NDArray[np.float64]) -> NDArray[np.float32]:
    seeds: NDArray[np.float32] = np.full(layout.cells.shape, NEVER, dtype=np.float32)
    row, col = layout.pixels(in_plane[:, :2])
    inside = (row >= 0) & (row < seeds.shape[0]) & (col >= 0) & (col < seeds.shape[1])
    for r, c, t in zip(row[inside], col[inside], times_ns[inside] / 1e9, strict=True):
        seeds[r, c] = min(seeds[r, c], np.float32(t))
    away_cells: Any = ndimage.distance_transform_edt(~np.isfinite(seeds))
    return spread(seeds, away_cells * layout.cell_m <= SIGHT_M / 2)
