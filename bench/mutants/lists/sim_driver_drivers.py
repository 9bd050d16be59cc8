"""Mutants of sim_driver/drivers."""

from bench.mutants.mutant import Mutant

GOALS, EXPLORE, COSTMAP = (f"sim_driver/drivers/{name}.py" for name in ("goals", "explore", "costmap"))

MUTANTS = (
    Mutant(
        GOALS,
        "goals.append(Goal(xy, path, not is_others[row, col], score))",
        "goals.append(Goal(xy, path, True, score))",
        "robots drive to the frontier that a teammate is nearer to",
    ),
    Mutant(
        GOALS,
        "if any(np.hypot(*(xy - bad)) < config.blacklist_radius_m for bad in given_up_m):",
        "if False:",
        "a robot goes for ever to a frontier that it cannot reach",
    ),
    Mutant(
        EXPLORE,
        "self._finished = now_ns - self._nothing_since_ns >= self._config.finish_after_s * NS",
        "self._finished = False",
        "exploration never ends",
    ),
    Mutant(
        EXPLORE,
        "            start, goals = self._goals(make_costmap(grid, self._finest, None, mates), T_map_base, mates)\n",
        "            start, goals = self._goals(make_costmap(grid, self._config, None, mates), T_map_base, mates)\n",
        "in a large map rooms whose doors close on coarse cells are never explored",
    ),
    Mutant(
        EXPLORE,
        "            self._next_plan_ns = now_ns + round(self._config.finish_after_s * NS)\n",
        "            pass\n",
        "robots that are done look for frontiers on the finest cells at every plan",
    ),
    Mutant(
        COSTMAP,
        "next((cell for cell in cells if hang_together(self.weight, *cell, least)), cells[0] if cells else None)",
        "cells[0] if cells else None",
        "a robot that stands beside a pocket between obstacles believes that all is explored",
    ),
    Mutant(
        COSTMAP,
        "np.flatnonzero(gap <= within_m)",
        "np.arange(gap.size)",
        "paths begin farther from the robot than they may",
    ),
    Mutant(
        COSTMAP,
        "_gap_m(occupied, resolution, body + config.comfort_m)",
        "_gap_m(occupied, resolution, body)",
        "paths lead right along walls",
    ),
    Mutant(
        "sim_driver/drivers/search.py",
        "_spread(weight, rows, cols, -1, -1, cost.copy())[2] >= 0",
        "travel(weight, rows, cols, -1, -1)[2] >= 0",
        "a robot with a teammate explores nothing that the teammate can reach",
    ),
    Mutant(
        COSTMAP,
        "weight[~free | (gap_m < body)] = np.inf",
        "weight[~free] = np.inf",
        "robots plan through gaps that they do not fit",
    ),
    Mutant(
        "sim_driver/drivers/follow.py",
        "return min(speed, math.sqrt(2.0 * BRAKE_M_S2 * gap)), turn",
        "return speed, turn",
        "robots drive into what their laser sees",
    ),
    Mutant(
        "sim_driver/drivers/waypoints.py",
        "        if self._recovery.is_stuck(now_ns, T_map_base):\n",
        "        if False:\n",
        "a robot that is held on its way to a waypoint stands there for ever",
    ),
    Mutant(
        "sim_driver/drivers/waypoints.py",
        "        return slow_for_obstacles(wanted, scan, self._config)\n",
        "        return wanted\n",
        "on the way to a waypoint a robot drives into what its laser sees",
    ),
    Mutant(
        "sim_driver/drivers/waypoints.py",
        "return slow_for_obstacles((min(speed, distance), turn), scan, self._config)",
        "return min(speed, distance), turn",
        "a robot that follows a recorded trajectory drives into what its laser sees",
    ),
    Mutant(
        "sim_driver/drivers/waypoints.py",
        "seen = seen_obstacles(scan, T_map_base, mates, self._config)",
        "seen = seen_obstacles(None, T_map_base, mates, self._config)",
        "ways to waypoints lead through what stands in the way and is not in the map",
    ),
    Mutant(
        "sim_driver/drivers/plan.py",
        "points = points[np.hypot(*(points - mate).T) > 2.0 * config.robot_radius_m]",
        "pass",
        "a teammate that passes closes the way for plans",
    ),
    Mutant(
        "sim_driver/drivers/recovery.py",
        "            if self._moved_ns is not None and metres > 4 * MOVED_M:\n                self.in_a_row = 0\n",
        "",
        "a robot that got free three times in an hour gives up every frontier at which it stops",
    ),
    Mutant(
        "sim_driver/drivers/explore.py",
        "            self._attempts.clear()\n",
        "",
        "frontiers that were given up get no second chance",
    ),
    Mutant(
        "sim_driver/drivers/explore.py",
        "if self._blacklist and self._forgiven < self._config.blacklist_forgiven:",
        "if False:",
        "frontiers behind a teammate that stood in the door are given up for good",
    ),
    Mutant(
        "sim_driver/drivers/waypoints.py",
        "make_costmap(around, self._config, seen, mates, through_unknown=True)",
        "make_costmap(around, self._config, seen, mates)",
        "robots push for ever against the wall that a waypoint is behind",
    ),
    Mutant(
        "sim_driver/drivers/waypoints.py",
        "around = surrounded(grid, AROUND_M)",
        "around = grid",
        "robots push for ever against the wall that a waypoint beyond the map is behind",
    ),
    Mutant(
        "sim_driver/drivers/waypoints.py",
        "return path if path is not None and len(path) > 1 else None",
        "return path",
        "a robot that leaves its map for a waypoint turns back at the edge for ever",
    ),
    Mutant(
        COSTMAP,
        "weight[unknown] *= UNKNOWN_PENALTY",
        "pass",
        "robots leave the way they know for walls they have not seen",
    ),
)
