"""Mutants of sim_driver."""

from bench.mutants.mutant import Mutant

TRUTH, SIDES, PAIRS = (f"sim_driver/evaluate/{name}.py" for name in ("truth", "sides", "pair_rows"))
GOALS, EXPLORE, COSTMAP = (f"sim_driver/drivers/{name}.py" for name in ("goals", "explore", "costmap"))
ROBOT, RAYCAST, ODOMETRY = (f"sim_driver/robots/{name}.py" for name in ("robot", "raycast", "odometry"))

MUTANTS = (
    Mutant(
        "sim_driver/faults/robot.py",
        "            self._die()\n",
        "",
        "a robot that crashed drives on, and nobody misses it",
    ),
    Mutant(
        "sim_driver/faults/robot.py",
        "self._make(Start(self.lives, now_ns, not self._from_nothing))",
        "self._make(Start(self.lives, now_ns, False))",
        "a robot that crashed has forgotten all when it comes back",
    ),
    Mutant(
        TRUTH,
        "FALSE_MERGE_M, FALSE_MERGE_DEG = 0.5, 5.0",
        "FALSE_MERGE_M, FALSE_MERGE_DEG = 50.0, 500.0",
        "false merges are judged to be right",
    ),
    Mutant(
        TRUTH,
        "return float(np.mean(values_at(grid, floor) == 0)) if len(floor) else 0.0",
        "return float(np.mean(values_at(grid, floor) <= 0)) if len(floor) else 0.0",
        "what nobody saw counts as covered",
    ),
    Mutant(
        TRUTH,
        "    if a.known_area_m2() < b.known_area_m2():\n        a, b,",
        "    if False:\n        a, b,",
        "a small map within a large one seems to share little with it",
    ),
    Mutant(
        "sim_driver/evaluate/relations.py",
        "error = se2.between(T_1_2, se2.between(first, second))",
        "error = se2.between(first, second) - T_1_2",
        "errors against relations are not those of the paper",
    ),
    Mutant(
        "sim_driver/evaluate/relations.py",
        "    own = (has_a1 & has_a2) | (has_b1 & has_b2)",
        "    own = (has_a1 & has_a2) & (has_b1 & has_b2)",
        "relations that one robot saw alone judge a merge",
    ),
    Mutant(
        "sim_driver/evaluate/trajectories.py",
        "placed = se2.compose(se2.fit_rigid(theirs[:, :2], ours[:, :2]), ours)",
        "placed = ours",
        "the absolute error depends on where a map's frame is",
    ),
    Mutant(
        SIDES,
        "all_s = times[-1 if ends else 0] if times and len(own) == len(ends) else None",
        "all_s = times[-1] if times else None",
        "a merge by one of two counts as one by both",
    ),
    Mutant(
        PAIRS,
        '    if any(view["is_false"] for view in views.values()):\n        return "false merge"',
        '    if False:\n        return "false merge"',
        "false merges are reported as correct ones",
    ),
    Mutant(
        GOALS,
        "goals.append(Goal(xy, path, nearest is None or int(nearest[row, col]) == 0, score))",
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
        ROBOT,
        "return gap - self.config.radius_m",
        "return gap",
        "robots drive through each other and into walls by their radius",
    ),
    Mutant(
        ROBOT,
        "cast_discs(x, y, heading, laser.angle_min_rad, laser.angle_increment_rad, *others, ranges)",
        "pass",
        "robots do not see each other",
    ),
    Mutant(
        RAYCAST,
        "            if along > 0.0 and chord2 >= 0.0:",
        "            if chord2 >= 0.0:",
        "a robot behind is seen in front",
    ),
    Mutant(
        ODOMETRY,
        "self._turn * turn + sigma_rad * heading,",
        "turn,",
        "wheels never turn wrong",
    ),
    Mutant(
        "sim_driver/robots/lasers.py",
        "true_ranges_m + sigma * noise, np.inf)",
        "true_ranges_m, np.inf)",
        "lasers measure without noise",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "- config.wall_loss_db * walls - shadowing_db",
        "- shadowing_db",
        "walls do not weaken the radio",
    ),
    Mutant(
        "sim_driver/worlds/radio.py",
        "return self.delivery**2",
        "return self.delivery",
        "links seem better than beacons of both sides would measure",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        "            mount = self._mounts[name] @ mount",
        "            mount = mount @ self._mounts[name]",
        "a laser on a turned mount is placed wrong",
    ),
    Mutant(
        "sim_driver/feeds/tf_tree.py",
        "        step[2] = wrap(step[2])\n",
        "",
        "odometry between two stamps spins round at half a turn",
    ),
    Mutant(
        "sim_driver/feeds/carmen.py",
        "range_max_m=min(line.range_max_m, longest_m),",
        "range_max_m=line.range_max_m,",
        "the longest readings of a log, which hit nothing, become walls",
    ),
    Mutant(
        "sim_driver/sweep/advice.py",
        "    safe = [one for one in summaries if one.false_merges == fewest]",
        "    safe = list(summaries)",
        "a sweep recommends a setting that merges falsely",
    ),
    Mutant(
        "sim_driver/missions/seeds.py",
        'text = f"{mission.mission.seed}/{purpose}".encode()',
        'text = f"{mission.mission.seed}".encode()',
        "everything random in a mission is the same randomness",
    ),
    Mutant(
        "sim_driver/faults/robot.py",
        "self._last = self._make(Start(self.lives, now_ns, not self._from_nothing))",
        "self._last = self._make(Start(self.lives, now_ns, True))",
        "amnesia forgets nothing",
    ),
    Mutant(
        "sim_driver/faults/links.py",
        "    return fault.active(now_ns) and not flaps_up",
        "    return False",
        "partitions cut nothing",
    ),
    Mutant(
        "sim_driver/replay/recording.py",
        "None if np.isnan(T_odom_base).any() else T_odom_base,",
        "None,",
        "a replay leaves odometry out",
    ),
    Mutant(
        "sim_driver/worlds/campus.py",
        "    _enter(cells)\n",
        "",
        "buildings of a campus are entered from one side only",
    ),
    Mutant(
        "sim_driver/missions/run_shapes.py",
        'Literal["accepted", "rejected", "revoked", "untried"]',
        'Literal["accepted", "rejected", "untried"]',
        "a robot whose merge was just taken back counts as damaged",
    ),
    Mutant(
        "sim_driver/report/undecided.py",
        'if not place.get("refuted", False)]',
        "]",
        "the report shows places where nobody was",
    ),
    Mutant(
        "sim_driver/simulation/simulation.py",
        "            if gap_m < apart_m:",
        "            if False:",
        "two robots may start in one place",
    ),
    Mutant(
        "sim_driver/run/known_area.py",
        'self.area_m2 = event.fields["team_m2"]',
        'self.area_m2 = event.fields["own_m2"]',
        "progress shows the own area beside names of those merged",
    ),
    Mutant(
        "sim_driver/sweep/work.py",
        'mission["exchanges"]["done"] // 2',
        'mission["exchanges"]["done"]',
        "sweeps count every exchange twice",
    ),
    Mutant(
        "sim_driver/evaluate/lost.py",
        "    return events[begun[-1] + 1 :] if begun else events",
        "    return events",
        "merges of a map that was given up count as those of the last one",
    ),
)
