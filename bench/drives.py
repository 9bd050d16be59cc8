"""Drives whose true poses are known: simulated ones through drawn floors, and stretches of recorded logs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d

from mrslam.sim_driver.evaluate.trajectories import matched
from mrslam.sim_driver.feeds import open_feed
from mrslam.sim_driver.feeds.base import Reading
from mrslam.sim_driver.robots.config import OdometryConfig
from mrslam.sim_driver.robots.lasers import LASERS
from mrslam.sim_driver.robots.odometry import Odometry
from mrslam.sim_driver.robots.raycast import cast, cast_discs, leap_field
from mrslam.sim_driver.worlds.world import World
from mrslam.spatial import OccupancyGrid, Scan, se2
from mrslam.spatial.files.tum import read_tum

SPEED_M_S, TURN_RAD_S, SCANS_PER_S = 0.8, 0.6, 5.0
"""The robot's usual speed and largest turning rate, and how often its laser sweeps."""
STEP_M, CORNER_M = 0.02, 0.5
"""Ways are sampled this often, and their corners rounded by this (1 sigma), metres."""
SPEED_CHANGES, SPEED_OVER_M = 0.2, 4.0
"""Share by which the speed wanders (1 sigma), and over what way, metres."""
CARRIED_S = 30.0
"""A robot that is carried sees nothing for this long, seconds."""


@dataclass(frozen=True, eq=False)
class Drive:
    """What a mapper is fed, and where the robot was: ``truth (N, 3)`` at each reading, NaN where that is not known."""

    readings: list[Reading]
    truth: NDArray[np.float64]

    def told(self, odometry: Sequence[NDArray[np.float64] | None]) -> Drive:
        """Return the same drive with other odometry."""
        return Drive([Reading(r.scan, told) for r, told in zip(self.readings, odometry, strict=True)], self.truth)

    def without_odometry(self) -> Drive:
        """Return the same drive without any."""
        return self.told([None] * len(self.readings))

    def dead_wheels(self, begin: float) -> Drive:
        """Wheels count no more from this share of the drive on."""
        last = int(begin * len(self.readings))
        return self.told(
            [r.T_odom_base if k < last else self.readings[last].T_odom_base for k, r in enumerate(self.readings)]
        )

    def carried(self, begin: int, end: int) -> Drive:
        """Readings ``begin .. end - 1`` never came, and the wheels did not count meanwhile."""
        after = self.readings[end:]
        before, there = self.readings[begin - 1].T_odom_base, after[0].T_odom_base
        assert before is not None and there is not None
        move = se2.compose(before, se2.inverse(there))
        moved = [Reading(r.scan, None if r.T_odom_base is None else se2.compose(move, r.T_odom_base)) for r in after]
        return Drive(self.readings[:begin] + moved, np.concatenate([self.truth[:begin], self.truth[end:]]))


def way_along(corners: Sequence[tuple[float, float]], rng: np.random.Generator) -> NDArray[np.float64]:
    """Return poses ``(N, 3)`` at every scan of a drive along straight lines, slower where it turns."""
    points = np.array(corners, dtype=np.float64)
    length = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    places = np.arange(0.0, length[-1], STEP_M)
    x, y = (gaussian_filter1d(np.interp(places, length, points[:, k]), CORNER_M / STEP_M) for k in (0, 1))
    dx, dy = np.gradient(x), np.gradient(y)
    heading = np.unwrap(np.arctan2(dy, dx))
    turns = np.abs(np.gradient(heading)) / np.maximum(np.hypot(dx, dy), 1e-3)
    wander = gaussian_filter1d(rng.standard_normal(x.size), SPEED_OVER_M / STEP_M)
    speed = SPEED_M_S * np.clip(1.0 + SPEED_CHANGES * wander / max(float(wander.std()), 1e-9), 0.3, 1.7)
    speed = np.minimum(gaussian_filter1d(speed, 0.3 / STEP_M), TURN_RAD_S / np.maximum(turns, 1e-3))
    times = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(x), np.diff(y)) / speed[1:])])
    at = np.arange(0.0, times[-1], 1.0 / SCANS_PER_S)
    return np.stack([np.interp(at, times, x), np.interp(at, times, y), se2.wrap(np.interp(at, times, heading))], axis=1)


def simulated(
    plan: OccupancyGrid,
    way: NDArray[np.float64],
    seed: int,
    range_m: float,
    odometry: OdometryConfig | None = None,
    people: NDArray[np.float64] | None = None,
    radius_m: float = 0.2,
) -> Drive:
    """Return what a robot with a laser of 360 degrees and this range sees and counts along a way ``(N, 3)``.

    ``people (N, P, 2)`` : where people of this radius are at each reading, metres.
    """
    rng = np.random.default_rng(seed)
    world = World("bench", plan)
    leap, cell = leap_field(world.clearance_cells), plan.resolution_m
    laser = replace(LASERS["lidar-360"], range_max_m=range_m)
    wheels = Odometry(odometry or OdometryConfig(), rng)
    readings, before = [], way[0]
    buffer = np.empty(laser.beams, dtype=np.float32)
    for k, pose in enumerate(way):
        wheels.advance(se2.between(before, pose))
        before = pose
        cast(
            leap, pose[0] / cell, pose[1] / cell, pose[2], laser.angle_min_rad, laser.angle_increment_rad,
            range_m / cell, buffer,
        )  # fmt: skip
        if people is not None:
            radii = np.full(len(people[k]), radius_m / cell)
            cast_discs(
                pose[0] / cell, pose[1] / cell, pose[2], laser.angle_min_rad, laser.angle_increment_rad,
                np.ascontiguousarray(people[k] / cell), radii, buffer,
            )  # fmt: skip
        scan = Scan(
            stamp_ns=round(1e9 * (k + 1) / SCANS_PER_S), ranges_m=laser.measure(buffer * np.float32(cell), rng),
            angle_min_rad=laser.angle_min_rad, angle_increment_rad=laser.angle_increment_rad, range_max_m=range_m,
        )  # fmt: skip
        readings.append(Reading(scan, wheels.T_odom_base.copy()))
    return Drive(readings, way)


def carried_between(first: Drive, second: Drive) -> Drive:
    """Return two drives as one: between them the robot was carried, and its wheels did not count."""
    end = first.readings[-1]
    start = second.readings[0].T_odom_base
    assert start is not None and end.T_odom_base is not None
    later_ns = end.scan.stamp_ns + round(1e9 * CARRIED_S)
    moved = [
        Reading(
            replace(r.scan, stamp_ns=r.scan.stamp_ns + later_ns),
            se2.compose(end.T_odom_base, se2.between(start, r.T_odom_base)),
        )
        for r in second.readings
        if r.T_odom_base is not None
    ]
    return Drive(first.readings + moved, np.concatenate([first.truth, second.truth]))


def recorded(log: Path, begin: float = 0.0, end: float = 1.0) -> Drive:
    """Return a stretch of a log, shares of its scans, with the poses of its reference beside it."""
    readings = list(open_feed(log).readings)
    readings = readings[int(begin * len(readings)) : int(end * len(readings))]
    stem = log.name.split(".")[0]
    while not (references := sorted(log.parent.glob(f"{stem}*.reference.tum"))):
        stem = stem.rpartition("-")[0]
        if not stem:
            raise FileNotFoundError(f"{log}: no reference trajectory beside it")
    stamps_ns = np.array([r.scan.stamp_ns for r in readings])
    reference = read_tum(references[0])
    index = np.stack([np.arange(len(readings), dtype=np.float64)] * 3, axis=1)
    _, at, poses = matched((stamps_ns, index), reference)
    truth = np.full((len(readings), 3), np.nan)
    truth[at[:, 0].astype(np.int64)] = poses
    return Drive(readings, truth)
