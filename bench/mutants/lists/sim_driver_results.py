"""Mutants of what sim_driver makes of a run: judges, results, report, replays; and of its planner."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "sim_driver/evaluate/sides.py",
        '{a, b} <= told.get("placed", {}).keys()',
        'b in told.get("placed", {})',
        "a robot alone is said to share a map",
    ),
    Mutant(
        "sim_driver/report/story.py",
        'return "good" if shares_one_map(pair) else "plain", ',
        'return "good", ',
        "what only a third robot knows is told as if the two knew it",
    ),
    Mutant(
        "sim_driver/evaluate/sides.py",
        '    if other in pair["placed_together_by"]:\n',
        "    if False:\n",
        "a robot that has a teammate in its map is told to have not",
    ),
    Mutant(
        "sim_driver/evaluate/truth.py",
        "    return off_m > FALSE_MERGE_M or off_deg > FALSE_MERGE_DEG",
        "    return off_m > FALSE_MERGE_M",
        "a merge that is turned counts as right",
    ),
    Mutant(
        "sim_driver/evaluate/judges.py",
        "    if relations is None or logs[a] is None or logs[a] != logs[b]:",
        "    if relations is None or logs[a] is None:",
        "robots of different logs are judged by one log's relations",
    ),
    Mutant(
        "sim_driver/evaluate/judges.py",
        '        return self.trajectories.get(robot_id, self.trajectories.get(""))',
        "        return self.trajectories.get(robot_id)",
        "a reference that holds for all robots is not used",
    ),
    Mutant(
        "sim_driver/evaluate/judges.py",
        "            found = replace(found, alignment_m=off_m, alignment_deg=off_deg)",
        "            pass",
        "the alignment's own error is not told",
    ),
    Mutant(
        "sim_driver/evaluate/judges.py",
        "found = _by_place(known, a, b, T_a_b)",
        "found = _by_place(known[::-1], a, b, T_a_b)",
        "a reference is preferred to the truth",
    ),
    Mutant(
        "sim_driver/evaluate/results.py",
        "                found[robot_id] = poses[int(np.abs(stamps_ns - first_ns).argmin()) if first_ns.size else 0]",
        "                found[robot_id] = poses[0]",
        "a robot that gave its map up is judged by where it set out",
    ),
    Mutant(
        "sim_driver/evaluate/results.py",
        '            times_s = mission_times_s(faults, [event["t"] for event in read.events])',
        '            times_s = [event["t"] for event in read.events]',
        "events of a robot whose clock jumped are told at wrong times",
    ),
    Mutant(
        "sim_driver/evaluate/results.py",
        "            if corrected.exists():",
        "            if False:",
        "errors of the team are those of rigid maps",
    ),
    Mutant(
        "sim_driver/evaluate/results.py",
        "        return {robot_id: places[frame] for robot_id, frame in frames.items() if frame in places}",
        "        return {robot_id: places[robot_id] for robot_id, frame in frames.items() if robot_id in places}",
        "a base station's map is judged in its own frame",
    ),
    Mutant(
        "sim_driver/evaluate/results.py",
        '        "exchanges": max((side["exchanges"] for side in sides), default=0),',
        '        "exchanges": sum(side["exchanges"] for side in sides),',
        "exchanges are counted twice",
    ),
    Mutant(
        "sim_driver/evaluate/results.py",
        '    if robot is not None and robot["id"] != path.parent.name:',
        "    if False:",
        "a robot.json copied into another's folder is believed",
    ),
    Mutant(
        "sim_driver/evaluate/results.py",
        "        return stamps, se2.compose(poses, np.array(laser.T_base_laser))",
        "        return stamps, poses",
        "trajectories of the laser are held against the base's",
    ),
    Mutant(
        "sim_driver/evaluate/truth.py",
        "        face = self.world.is_occupied & (euclidean(np.ascontiguousarray(self.reachable)) <= 1.5)",
        "        face = self.world.is_occupied",
        "walls' insides count as missed",
    ),
    Mutant(
        "sim_driver/evaluate/truth.py",
        "        return int(np.count_nonzero(cKDTree(paths).query(lone)[0] <= radius_m))",
        "        return 0",
        "no ghosts are ever counted",
    ),
    Mutant(
        "sim_driver/drivers/costmap.py",
        "    weight[~free | (gap_m < body)] = np.inf",
        "    weight[~free] = np.inf",
        "robots plan through gaps they do not fit",
    ),
    Mutant(
        "sim_driver/drivers/costmap.py",
        "    if hopeful:\n",
        "    if False:\n",
        "a ghost in a doorway locks a robot in",
    ),
    Mutant(
        "sim_driver/drivers/costmap.py",
        "[(rows + 0.5 - row) ** 2 + (cols + 0.5 - col) ** 2 <= radius**2] += CROWD_PENALTY",
        "[(rows + 0.5 - row) ** 2 + (cols + 0.5 - col) ** 2 <= radius**2] += 0.0",
        "robots drive into each other",
    ),
    Mutant(
        "sim_driver/drivers/costmap.py",
        "        occupied[rows[inside], cols[inside]] = True\n",
        "",
        "what stands in the way now is not avoided",
    ),
    Mutant(
        "sim_driver/report/seen.py",
        "        if np.hypot(*(pose - before)[:2]) < STEP_M and abs(se2.wrap(pose[2] - before[2])) < STEP_RAD:",
        "        if np.hypot(*(pose - before)[:2]) < STEP_M:",
        "what a robot saw as it turned on the spot is missing in the report",
    ),
    Mutant(
        "sim_driver/report/seen.py",
        "        stamps = in_mission_time(stamps, run.began_s(robot_id))",
        "        stamps = in_mission_time(stamps, 0.0)",
        "agents that began late are shown too early",
    ),
    Mutant(
        "sim_driver/replay/again.py",
        '    if read_config(run).get("faults"):',
        "    if False:",
        "a run with faults is replayed wrongly",
    ),
    Mutant(
        "sim_driver/replay/again.py",
        '        if section not in REPLAYABLE and (section, key) != ("mission", "seed"):',
        "        if False:",
        "a replay claims another radio",
    ),
    Mutant(
        "sim_driver/replay/again.py",
        "        if truth.exists():",
        "        if False:",
        "a replay is not judged by the truth",
    ),
)
