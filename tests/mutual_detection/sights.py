"""Robots in a world that look at each other, without any mapper."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.mutual_detection import Moment, find_bodies
from mrslam.sim_driver.robots import LASERS, SimulatedRobot
from mrslam.sim_driver.worlds import World, load_world
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

RADIUS_M = 0.18
OFFICE = load_world("office")
NOBODY = np.empty((0, 2))


def sweep(
    T_world_base: Transform, bodies_m: list[NDArray[np.float64]], *, laser: str = "lidar-360", world: World = OFFICE,
    radius_m: float = RADIUS_M, seed: int = 0,
) -> Scan:  # fmt: skip
    """Return a scan from a pose in a world in which round bodies stand, ``(2,)`` each, world frame."""
    robot = SimulatedRobot(world, T_world_base, LASERS[laser], np.random.default_rng(seed))
    return robot.scan(0, (np.array(bodies_m).reshape(-1, 2), np.full(len(bodies_m), radius_m)))


def moment(
    T_world_own: Transform, T_world_mate: Transform, frames: tuple[Transform, Transform],
    others_m: list[NDArray[np.float64]] | None = None, *, seed: int = 0, hidden: bool = False,
) -> Moment:  # fmt: skip
    """Return what one robot makes of an instant; ``frames`` : ``T_world_map`` of both; ``hidden`` : bodies too low."""
    others = others_m or []
    own = sweep(T_world_own, others + ([] if hidden else [T_world_mate[:2]]), seed=seed)
    mate = sweep(T_world_mate, others + ([] if hidden else [T_world_own[:2]]), seed=seed + 1000)
    return Moment(
        own, find_bodies(own, RADIUS_M), se2.between(frames[0], T_world_own), se2.between(frames[1], T_world_mate),
        find_bodies(mate, RADIUS_M),
    )  # fmt: skip


def way(start: tuple[float, float], stop: tuple[float, float], count: int, turn_rad: float = 0.0) -> list[Transform]:
    """Return poses on a straight line, turning evenly."""
    return [
        se2.transform(*(np.array(start) + share * (np.array(stop) - start)), turn_rad * share)
        for share in np.linspace(0.0, 1.0, count)
    ]
