"""Frontier exploration: go where the known free floor borders on the unknown, until there is no such place left.

After explore_lite (Hörner 2016, section 3.2) and Yamauchi 1997, with a team: a frontier that a teammate is nearer to is
left to it.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_driver.drivers.base import STOP, Command
from sim_driver.drivers.config import DriverConfig
from sim_driver.drivers.costmap import Costmap, make_costmap
from sim_driver.drivers.follow import slow_for_obstacles, steer
from sim_driver.drivers.plan import SNAP_M, length_m, seen_obstacles
from sim_driver.drivers.recovery import Recovery
from sim_driver.drivers.search import frontiers, trace, travel
from spatial import OccupancyGrid, Scan, se2
from spatial.se2 import Transform

log = logging.getLogger(__name__)

NS = 1_000_000_000
BIGGEST_GAIN_M = 5.0
"""Longer frontiers gain no more than this."""
ARRIVED_M = 0.4
"""At a goal this near there is nothing more to drive, only to look."""
PASSED_OVER_NS = 4 * NS
"""How long a goal that was reached is passed over: by then the map shows it as known, or it is tried again."""
STEP_NS = NS // 2
"""How soon after reaching a goal the next one is chosen."""
LAST_WRIGGLE = 5
"""A robot that is still walled in after so many tries to get free gives up."""
PROGRESS_M = 0.2
"""A goal that came this much nearer has made progress."""
SCAN_ROUND: Command = (0.0, 0.6)
"""What to do while there is nothing to plan on: look around."""


@dataclass(frozen=True, eq=False)
class Goal:
    """A frontier worth a visit."""

    xy_m: NDArray[np.float64]
    """``(2,)``, where to stand, map frame."""
    path_m: NDArray[np.float64]
    """``(N, 2)``, how to get there."""
    size_m: float
    """Length of the frontier."""
    is_mine: bool
    """Whether no teammate is nearer to it."""
    cost_m: float
    """Lower is better."""


@dataclass(eq=False)
class Attempt:
    """How a goal has been approached, over all times it was chosen: two goals taken in turns both run out of time."""

    x_m: float
    y_m: float
    nearest_m: float = math.inf
    spent_s: float = 0.0
    passed_over_until_ns: int = 0

    def spend(self, seconds: float, way_m: float) -> float:
        """Return how long it has been chosen without coming nearer; standing at it counts threefold."""
        if way_m < self.nearest_m - PROGRESS_M:
            self.nearest_m, self.spent_s = way_m, 0.0
        else:
            self.spent_s += seconds * (3.0 if way_m < ARRIVED_M else 1.0)
        return self.spent_s


class Explorer:
    """Explores on its own map, or on the team's where that is given."""

    def __init__(self, config: DriverConfig | None = None, seed: int = 0) -> None:
        """``seed`` decides only how the robot wriggles free."""
        self._config = config or DriverConfig()
        self._recovery = Recovery(self._config, np.random.default_rng(seed))
        self._goal: Goal | None = None
        self._blacklist: list[NDArray[np.float64]] = []
        self._forgiven = 0
        self._next_plan_ns = 0
        self._attempts: list[Attempt] = []
        self._nothing_since_ns: int | None = None
        self._walled_in_since_ns: int | None = None
        self._finished = False
        self._finished_on: OccupancyGrid | None = None

    @property
    def finished(self) -> bool:
        """Whether no reachable frontier is left."""
        return self._finished

    @property
    def goal_m(self) -> NDArray[np.float64] | None:
        """Where it is going, ``(2,)`` in the map frame."""
        return None if self._goal is None else self._goal.xy_m

    def command(
        self,
        now_ns: int,
        T_map_base: Transform,
        grid: OccupancyGrid | None,
        teammates: Mapping[str, Transform],
        scan: Scan | None = None,
    ) -> Command:
        """See :class:`sim_driver.drivers.Driver`."""
        if grid is None or grid.cells.size == 0:
            return SCAN_ROUND
        escape = self._recovery.command(now_ns)
        if escape is not None:
            return escape
        if now_ns >= self._next_plan_ns and not (self._finished and grid is self._finished_on):
            self._next_plan_ns = now_ns + round(self._config.plan_interval_s * NS)
            self._plan(now_ns, T_map_base, grid, teammates, scan)
        if self._goal is None:
            self._recovery.rest(now_ns)
            return STOP if self._finished else SCAN_ROUND  # a map is made of scans from more than one direction
        gap_m = float(np.hypot(*(self._goal.path_m[-1] - T_map_base[:2])))
        attempt = self._attempt_at(self._goal.xy_m)
        if gap_m < ARRIVED_M and attempt.passed_over_until_ns <= now_ns:
            # The map will show in a moment what is seen from here; do not stand and wait for it.
            attempt.passed_over_until_ns = now_ns + PASSED_OVER_NS
            self._next_plan_ns = min(self._next_plan_ns, now_ns + STEP_NS)
        if gap_m < 0.1:
            self._recovery.rest(now_ns)
            return SCAN_ROUND
        wanted = steer(T_map_base, self._goal.path_m, self._config)
        command = slow_for_obstacles(wanted, scan, self._config)
        if self._recovery.is_stuck(now_ns, T_map_base):
            log.debug("stuck at %s on the way to %s", T_map_base, self._goal.xy_m)
            self._next_plan_ns = now_ns
            if self._recovery.in_a_row >= 3:
                self._give_up(now_ns)
            return self._recovery.start(now_ns)
        return command

    def _plan(
        self,
        now_ns: int,
        T_map_base: Transform,
        grid: OccupancyGrid,
        teammates: Mapping[str, Transform],
        scan: Scan | None,
    ) -> None:
        mates = np.array([teammates[name][:2] for name in sorted(teammates)]).reshape(-1, 2)
        seen = seen_obstacles(scan, T_map_base, mates, self._config)
        start, goals = self._goals(make_costmap(grid, self._config, seen, mates), T_map_base, mates)
        if not goals:  # what moves may only be in the way for now
            start, goals = self._goals(make_costmap(grid, self._config, None, mates), T_map_base, mates)
        if start is not None and not goals:  # as may be what was taken for a wall
            start, goals = self._goals(make_costmap(grid, self._config, None, mates, hopeful=True), T_map_base, mates)
        if start is None:
            self._walled_in(now_ns)
            return
        self._walled_in_since_ns = None
        if not goals:
            self._none_left(now_ns, grid)
            return
        self._nothing_since_ns, self._finished = None, False
        attempts = [self._attempt_at(goal.xy_m) for goal in goals]
        best, attempt = min(
            zip(goals, attempts, strict=True),
            key=lambda pair: (pair[1].passed_over_until_ns > now_ns, not pair[0].is_mine, pair[0].cost_m),
        )
        self._goal = best
        if attempt.spend(self._config.plan_interval_s, length_m(best.path_m)) > self._config.progress_timeout_s:
            self._give_up(now_ns)

    def _walled_in(self, now_ns: int) -> None:
        """No open cell is near: something moves, or the map is young. Look around, wriggle, in the end give up."""
        self._goal = None
        if self._walled_in_since_ns is None:
            self._walled_in_since_ns = now_ns
        elif now_ns - self._walled_in_since_ns > self._config.finish_after_s * NS:
            self._finished = self._recovery.in_a_row >= LAST_WRIGGLE
            if not self._finished:
                self._walled_in_since_ns = now_ns
                self._recovery.start(now_ns)

    def _attempt_at(self, xy_m: NDArray[np.float64]) -> Attempt:
        x, y = xy_m.tolist()
        for attempt in self._attempts:
            if math.hypot(attempt.x_m - x, attempt.y_m - y) < self._config.blacklist_radius_m:
                return attempt
        self._attempts.append(Attempt(x, y))
        return self._attempts[-1]

    def _goals(
        self, costmap: Costmap, T_map_base: Transform, mates: NDArray[np.float64]
    ) -> tuple[tuple[int, int] | None, list[Goal]]:
        """Return the cell that the robot sets out from (None where it is walled in), and all goals."""
        config, resolution = self._config, costmap.resolution_m
        start = costmap.nearest_open(T_map_base[:2], SNAP_M)
        if start is None:
            return None, []
        starts = [start] + [cell for xy in mates if (cell := costmap.nearest_open(xy, SNAP_M)) is not None]
        rows, cols = np.array(starts, dtype=np.int32).T.copy()
        cost, before, _ = travel(costmap.weight, rows[:1], cols[:1], -1, -1)
        nearest = travel(costmap.weight, rows, cols, -1, -1)[2] if len(starts) > 1 else None
        window = int(np.ceil((config.robot_radius_m + config.margin_m) / resolution)) + 1
        sizes, cells = frontiers(costmap.is_frontier, cost, window)
        goals = []
        for size, (row, col) in zip(sizes, cells, strict=True):
            size_m = float(size) * resolution
            if row < 0 or size_m < config.min_frontier_m:
                continue
            xy = costmap.point(np.array([row, col], dtype=np.int32))
            if any(np.hypot(*(xy - bad)) < config.blacklist_radius_m for bad in self._blacklist):
                continue
            path = costmap.point(trace(before, row, col))
            aim = path[min(len(path) - 1, int(1.0 / resolution))] - T_map_base[:2]
            turn = abs(float(se2.wrap(np.arctan2(aim[1], aim[0]) - T_map_base[2])))
            way = float(cost[row, col]) * resolution
            kept = self._goal is not None and np.hypot(*(xy - self._goal.xy_m)) < 1.0
            score = config.path_scale * way - config.gain_scale * min(size_m, BIGGEST_GAIN_M)
            score += config.turn_scale * turn - config.keep_goal_m * kept
            goals.append(Goal(xy, path, size_m, nearest is None or int(nearest[row, col]) == 0, score))
        return start, goals

    def _none_left(self, now_ns: int, grid: OccupancyGrid) -> None:
        self._goal = None
        if self._blacklist and self._forgiven < self._config.blacklist_forgiven:
            self._blacklist.clear()
            self._attempts.clear()
            self._forgiven += 1
            return
        if self._nothing_since_ns is None:
            self._nothing_since_ns = now_ns
        self._finished = now_ns - self._nothing_since_ns >= self._config.finish_after_s * NS
        self._finished_on = grid

    def _give_up(self, now_ns: int) -> None:
        if self._goal is not None:
            log.debug("giving up the frontier at %s", self._goal.xy_m)
            self._blacklist.append(self._goal.xy_m)
        self._goal = None
        self._recovery.in_a_row = 0
        self._next_plan_ns = now_ns
