"""Goals of exploration: which frontiers can be reached, what each costs, and whose each is."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.sim_driver.drivers.costmap import Costmap
from mrslam.sim_driver.drivers.plan import SNAP_M
from mrslam.sim_driver.drivers.search import frontiers, nearer, trace, travel
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

BIGGEST_GAIN_M = 5.0
"""Longer frontiers gain no more than this."""


@dataclass(frozen=True, eq=False)
class Goal:
    """A frontier worth a visit."""

    xy_m: NDArray[np.float64]
    """``(2,)``, where to stand, map frame."""
    path_m: NDArray[np.float64]
    """``(N, 2)``, how to get there."""
    is_mine: bool
    """Whether no teammate is nearer to it."""
    cost_m: float
    """Lower is better."""


def find_goals(
    costmap: Costmap,
    T_map_base: Transform,
    mates_m: NDArray[np.float64],
    config: DriverConfig,
    going_to_m: NDArray[np.float64] | None = None,
    given_up_m: Sequence[NDArray[np.float64]] = (),
) -> tuple[tuple[int, int] | None, list[Goal]]:
    """Return the cell that the robot sets out from (None where it is walled in), and all goals.

    ``mates_m (M, 2)``: where teammates are; ``going_to_m (2,)``: the present goal, worth keeping; ``given_up_m``: no
    goal is near these.
    """
    resolution = costmap.resolution_m
    start = costmap.nearest_open(T_map_base[:2], SNAP_M)
    if start is None:
        return None, []
    starts = [start] + [cell for xy in mates_m if (cell := costmap.nearest_open(xy, SNAP_M)) is not None]
    rows, cols = np.array(starts, dtype=np.int32).T.copy()
    cost, before, _ = travel(costmap.weight, rows[:1], cols[:1], -1, -1)
    is_others = nearer(costmap.weight, rows[1:], cols[1:], cost)
    window = int(np.ceil((config.robot_radius_m + config.margin_m) / resolution)) + 1
    sizes, cells = frontiers(costmap.is_frontier, cost, window)
    goals = []
    for size, (row, col) in zip(sizes, cells, strict=True):
        size_m = float(size) * resolution
        if row < 0 or size_m < config.min_frontier_m:
            continue
        xy = costmap.point(np.array([row, col], dtype=np.int32))
        if any(np.hypot(*(xy - bad)) < config.blacklist_radius_m for bad in given_up_m):
            continue
        path = costmap.point(trace(before, row, col))
        aim = path[min(len(path) - 1, int(1.0 / resolution))] - T_map_base[:2]
        turn = abs(float(se2.wrap(np.arctan2(aim[1], aim[0]) - T_map_base[2])))
        way = float(cost[row, col]) * resolution
        kept = going_to_m is not None and np.hypot(*(xy - going_to_m)) < 1.0
        score = config.path_scale * way - config.gain_scale * min(size_m, BIGGEST_GAIN_M)
        score += config.turn_scale * turn - config.keep_goal_m * kept
        goals.append(Goal(xy, path, not is_others[row, col], score))
    return start, goals
