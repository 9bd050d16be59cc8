"""Frontier exploration: go where the known free floor borders on the unknown, until there is no such place left.

After explore_lite (Hörner 2016, section 3.2) and Yamauchi 1997, with a team: a frontier that a teammate is nearer to is
left to it.
"""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.drivers.attempts import ARRIVED_M, Attempts
from mrslam.sim_driver.drivers.base import STOP, Command
from mrslam.sim_driver.drivers.config import DriverConfig
from mrslam.sim_driver.drivers.costmap import Costmap, coarseness, make_costmap
from mrslam.sim_driver.drivers.follow import slow_for_obstacles, steer
from mrslam.sim_driver.drivers.goals import Goal, find_goals
from mrslam.sim_driver.drivers.plan import length_m, seen_obstacles
from mrslam.sim_driver.drivers.recovery import Recovery
from mrslam.spatial import OccupancyGrid, Scan
from mrslam.spatial.se2 import Transform

log = logging.getLogger(__name__)

NS = 1_000_000_000
PASSED_OVER_NS = 4 * NS
"""How long a goal that was reached is passed over: by then the map shows it as known, or it is tried again."""
STEP_NS = NS // 2
"""How soon after reaching a goal the next one is chosen."""
FINEST_CELLS = 1_000_000
"""Cells that are planned on where there is nowhere to go on fewer: 0.05 s each time."""
LAST_WRIGGLE = 5
"""A robot that is still walled in after so many tries to get free gives up."""
SCAN_ROUND: Command = (0.0, 0.6)
"""What to do while there is nothing to plan on: look around."""


class Explorer:
    """Explores on its own map, or on the team's where that is given."""

    def __init__(self, config: DriverConfig | None = None, seed: int = 0) -> None:
        """``seed`` decides only how the robot wriggles free."""
        self._config = config or DriverConfig()
        self._finest = replace(self._config, max_plan_cells=max(self._config.max_plan_cells, FINEST_CELLS))
        self._recovery = Recovery(self._config, np.random.default_rng(seed))
        self._goal: Goal | None = None
        self._blacklist: list[NDArray[np.float64]] = []
        self._forgiven = 0
        self._next_plan_ns = 0
        self._attempts = Attempts(self._config.blacklist_radius_m)
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
        """See :class:`mrslam.sim_driver.drivers.Driver`."""
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
        attempt = self._attempts.at(self._goal.xy_m)
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
        if not goals and coarseness(grid, self._finest) < coarseness(grid, self._config):  # on which doors close
            start, goals = self._goals(make_costmap(grid, self._finest, None, mates), T_map_base, mates)
        if start is not None and not goals:  # what was taken for a wall may move, too
            start, goals = self._goals(make_costmap(grid, self._finest, None, mates, hopeful=True), T_map_base, mates)
        if start is None:
            self._walled_in(now_ns)
            return
        self._walled_in_since_ns = None
        if not goals:
            self._none_left(now_ns, grid)
            return
        self._nothing_since_ns, self._finished = None, False
        attempts = [self._attempts.at(goal.xy_m) for goal in goals]
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

    def _goals(
        self, costmap: Costmap, T_map_base: Transform, mates_m: NDArray[np.float64]
    ) -> tuple[tuple[int, int] | None, list[Goal]]:
        going_to_m = None if self._goal is None else self._goal.xy_m
        return find_goals(costmap, T_map_base, mates_m, self._config, going_to_m, self._blacklist)

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
        if self._finished:  # teammates may still find something, but a look at the finest cells is dear
            self._next_plan_ns = now_ns + round(self._config.finish_after_s * NS)

    def _give_up(self, now_ns: int) -> None:
        if self._goal is not None:
            log.debug("giving up the frontier at %s", self._goal.xy_m)
            self._blacklist.append(self._goal.xy_m)
        self._goal = None
        self._recovery.in_a_row = 0
        self._next_plan_ns = now_ns
