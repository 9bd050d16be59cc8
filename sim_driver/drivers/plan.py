"""Paths to given goals on the robot's own map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.sim_driver.drivers.costmap import Costmap
from mrslam.sim_driver.drivers.search import trace, travel
from mrslam.spatial import UNKNOWN, OccupancyGrid, Scan, se2
from mrslam.spatial.se2 import Transform

SEEN_WITHIN_M = 2.0
"""Returns nearer than this are obstacles for planning, whatever the map says."""
SNAP_M = 0.6
"""How far from the robot or the goal the nearest open cell may be."""


def seen_obstacles(
    scan: Scan | None, T_map_base: Transform, teammates_m: NDArray[np.float64], config: DriverConfig
) -> NDArray[np.float64]:
    """Return the near returns ``(N, 2)`` in the map frame, without those of teammates ``(M, 2)``, who move on."""
    if scan is None:
        return np.empty((0, 2))
    points = scan.points_base()
    reach = np.hypot(points[:, 0], points[:, 1])
    points = se2.apply(T_map_base, points[(reach > config.robot_radius_m) & (reach < SEEN_WITHIN_M)])
    for mate in teammates_m:
        points = points[np.hypot(*(points - mate).T) > 2.0 * config.robot_radius_m]
    return points


def path_between(
    costmap: Costmap, start_m: NDArray[np.float64], goal_m: NDArray[np.float64], snap_m: float = SNAP_M
) -> NDArray[np.float64] | None:
    """Return the cheapest path ``(N, 2)`` by A*, from the open cell nearest to the start; None where there is none."""
    start, goal = costmap.nearest_open(start_m, snap_m), costmap.nearest_open(goal_m, snap_m)
    if start is None or goal is None:
        return None
    source = np.array(start, dtype=np.int32)
    cost, before, _ = travel(costmap.weight, source[:1], source[1:], *goal)
    return costmap.point(trace(before, *goal)) if np.isfinite(cost[goal]) else None


def surrounded(grid: OccupancyGrid, width_m: float) -> OccupancyGrid:
    """Return a map with unknown cells around it."""
    width = round(width_m / grid.resolution_m)
    x, y = (origin - width * grid.resolution_m for origin in grid.origin_m)
    return OccupancyGrid(np.pad(grid.cells, width, constant_values=UNKNOWN), grid.resolution_m, (x, y))


def length_m(path_m: NDArray[np.float64]) -> float:
    """Return the length of a path ``(N, 2)``."""
    return float(np.hypot(*np.diff(path_m, axis=0).T).sum()) if len(path_m) > 1 else 0.0
