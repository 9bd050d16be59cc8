"""Mutants of sim_driver/evaluate."""

from bench.mutants.mutant import Mutant

TRUTH, SIDES, PAIRS = (f"sim_driver/evaluate/{name}.py" for name in ("truth", "sides", "pair_rows"))

MUTANTS = (
    Mutant(
        TRUTH,
        "FALSE_MERGE_M, FALSE_MERGE_DEG = 0.5, 5.0",
        "FALSE_MERGE_M, FALSE_MERGE_DEG = 50.0, 500.0",
        "false merges are judged to be right",
    ),
    Mutant(
        TRUTH,
        "return float(np.mean(values == 0)) if len(values) else 0.0",
        "return float(np.mean(values <= 0)) if len(values) else 0.0",
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
        "sim_driver/evaluate/lost.py",
        "    return events[begun[-1] + 1 :] if begun else events",
        "    return events",
        "merges of a map that was given up count as those of the last one",
    ),
    Mutant(
        "sim_driver/evaluate/network.py",
        'event["quality"] if event["event"] == "link_changed" else 0.0',
        'event.get("quality", 1.0)',
        "a link counts as good as it last was long after the peer is gone",
    ),
    Mutant(
        "sim_driver/evaluate/network.py",
        'total, since = total + event["t"] - since, None',
        'total = total + event["t"] - since',
        "time in sight of a peer is counted over and over",
    ),
    Mutant(
        "sim_driver/evaluate/network.py",
        "weights @ (values >= threshold)",
        "weights @ (values <= threshold)",
        "the share of time in which a link was strong is that in which it was weak",
    ),
    Mutant(
        "sim_driver/evaluate/mission_row.py",
        'if pair["error_m"] <= off_m and pair["error_deg"] <= off_deg]',
        'if pair["error_m"] <= off_m or pair["error_deg"] <= off_deg]',
        "alignments that are turned far off count as accurate",
    ),
    Mutant(
        "sim_driver/evaluate/mission_row.py",
        'low <= p["true_overlap"] < high + (high == 1.0)',
        'low <= p["true_overlap"] < high',
        "maps that overlap entirely are left out of the table of successes",
    ),
    Mutant(
        "sim_driver/evaluate/mission_row.py",
        'correct_s += [] if judged.is_false else [event["t"]]',
        'correct_s += [event["t"]]',
        "a wrong merge counts as the first right one",
    ),
    Mutant(
        "sim_driver/evaluate/mission_row.py",
        '"coverage_worst": min(',
        '"coverage_worst": max(',
        "the robot that knows least seems to know as much as the best",
    ),
    Mutant(
        "sim_driver/evaluate/team.py",
        "min(precision for _, precision",
        "max(precision for _, precision",
        "a team map with ghost walls hides behind a good one in the metrics",
    ),
    Mutant(
        "sim_driver/evaluate/robot_rows.py",
        "off.mean(axis=0), off.std(axis=0)",
        "off.mean(axis=0), off.mean(axis=0)",
        "the spread of errors over relations is their mean",
    ),
    Mutant(
        "sim_driver/evaluate/trajectories.py",
        "near = np.abs(stamps[nearest] - estimate[0]) <= NEAR_NS",
        "near = np.abs(stamps[nearest] - estimate[0]) <= 50 * NEAR_NS",
        "poses are compared with where the reference was a second before",
    ),
    Mutant(
        "sim_driver/evaluate/trajectories.py",
        "first, second = first[exact], second[exact]",
        "pass",
        "drift over one second includes that across gaps without scans",
    ),
    Mutant(
        "sim_driver/evaluate/doubtful.py",
        "np.abs(np.diff(seconds)) > APART_S",
        "np.diff(seconds) > APART_S",
        "doubts before and after a leap back of a log's time are told as one long stretch",
    ),
    Mutant(
        "sim_driver/evaluate/events.py",
        ' if not (is_saved(one["a"]) or is_saved(one["b"]))',
        "",
        "a place in a saved map is told as the first merge of two robots",
    ),
    Mutant(
        "sim_driver/evaluate/in_saved_maps.py",
        "rows.get(key, new)",
        "new",
        "a robot that was lost in a saved map and found again was localised the second time only",
    ),
    Mutant(
        "sim_driver/evaluate/in_saved_maps.py",
        '"lost_s": None, "reason": ""}',
        '"reason": ""}',
        "a robot that was found again in a saved map is told as lost",
    ),
)
