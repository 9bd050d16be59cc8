"""Mutants of merge/sessions."""

from bench.mutants.mutant import Mutant

CHANGES, THINNING, ONE_MAP, DIFF = (f"merge/sessions/{name}.py" for name in ("changes", "thinning", "one_map", "diff"))
REPEATED = "merge/sessions/repeated.py"

MUTANTS = (
    Mutant(
        ONE_MAP,
        "    check_sessions(given)\n",
        "",
        "a session that the saved map holds is added once more, and what was seen since is undone",
    ),
    Mutant(
        REPEATED,
        "    return not keys.isdisjoint(other_keys) or (",
        "    return (",
        "a session that the saved map holds is taken for a new one when its folder was renamed",
    ),
    Mutant(
        REPEATED,
        " or (one.name == other.name and not (keys and other_keys))",
        "",
        "a session of which newer ones replaced all keyframes is taken for a new one",
    ),
    Mutant(
        REPEATED,
        "    if one.way_m != other.way_m or not one.way_m:\n",
        "    if not one.way_m:\n",
        "the rest of a drive cannot be added to the saved map",
    ),
    Mutant(
        CHANGES,
        "    is_new_wall = after.is_occupied & ~was_near\n",
        "    is_new_wall = after.is_occupied\n",
        "walls of a saved map grow thicker with every session",
    ),
    Mutant(
        CHANGES,
        "    is_new_floor = after.is_free & ~(before.is_occupied & is_near)\n",
        "    is_new_floor = after.is_free\n",
        "walls of a saved map are lost where a session shows them beside themselves",
    ),
    Mutant(
        CHANGES,
        "    is_new_floor = after.is_free & ~(before.is_occupied & is_near)\n",
        "    is_new_floor = after.is_free & ~before.is_occupied\n",
        "furniture that went stays in the saved map",
    ),
    Mutant(
        THINNING,
        "        if not covers.any():\n",
        "        if True:\n",
        "a saved map grows with every visit",
    ),
    Mutant(
        THINNING,
        "        covers &= show(seen[others], seen[k])\n",
        "",
        "what was seen driving the other way is left out",
    ),
    Mutant(
        ONE_MAP,
        "    return OneMap(thinned(reduce(_continued, placed)), result)\n",
        "    return OneMap(thinned(reduce(_continued, placed[::-1])), result)\n",
        "what was seen first wins",
    ),
    Mutant(
        DIFF,
        "float(sizes[k] * cell_m2)",
        "float((label == k).sum() * cell_m2)",
        "pieces that changed are listed larger than they are",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "    edge = 1 + math.floor(",
        "    edge = 2 + math.floor(",
        "strokes 0.2 m apart are one piece",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "    edge = 1 + math.floor(",
        "    edge = math.floor(",
        "strokes 0.15 m apart are two pieces",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "mask & is_piece[label]",
        "is_piece[label]",
        "what did not change beside a piece is drawn as changed",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "sizes * cell_m2 >= least_m2 - 1e-9",
        "sizes * cell_m2 >= 0.0",
        "every speck of noise is a change",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "    one = warp(one, np.zeros(3))\n",
        "",
        "maps whose origins lie between cells are refused",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "    if NAMES[1] in result.team_map.unplaced:",
        "    if False:",
        "maps of two buildings are compared",
    ),
    Mutant(
        "merge/sessions/changes.py",
        "vanished=before.is_occupied & after.is_free & ~is_near",
        "vanished=before.is_occupied & after.is_free",
        "walls drawn a cell beside are told as gone",
    ),
    Mutant(
        "merge/sessions/changes.py",
        "appeared=after.is_occupied & before.is_free & ~was_near",
        "appeared=after.is_occupied & ~was_near",
        "what was never seen before is told as new furniture",
    ),
    Mutant(
        "merge/sessions/one_map.py",
        "    grid = later_wins(one, two)",
        "    grid = later_wins(two, one)",
        "of two sessions the older one is right",
    ),
    Mutant(
        "merge/sessions/one_map.py",
        "        stays = not T_team_map.any() and bend.most_m < resolution_m",
        "        stays = False",
        "walls thicken with every session",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "both = self.before.is_known & self.after.is_known",
        "both = self.before.is_known | self.after.is_known",
        "the area that both maps have seen is said to be larger than it is",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "return one, two, max((bend.most_m for bend in result.team_map.bends.values()), default=0.0)",
        "return one, two, 0.0",
        "maps that were bent to fit are said to be laid as they are",
    ),
    Mutant(
        "merge/sessions/one_map.py",
        "np.concatenate([before.keyframes.T_map_base, after.keyframes.T_map_base]),",
        "np.concatenate([after.keyframes.T_map_base, before.keyframes.T_map_base]),",
        "keyframes of two sessions change places: a continued map bends to nonsense",
    ),
    Mutant(
        "merge/sessions/one_map.py",
        "before.scans.append(after.scans), before.sessions",
        "after.scans.append(before.scans), before.sessions",
        "scans of two sessions change places: a continued map cannot be bent any more",
    ),
    Mutant(
        "merge/sessions/one_map.py",
        "for name, saved in given.items() if _is_placed(name, result)]",
        "for name, saved in given.items()]",
        "a session that fits nowhere ends in a traceback",
    ),
    Mutant(
        "merge/sessions/picture.py",
        "picture[before.is_known & after.is_known] = FLOOR",
        "picture[before.is_known | after.is_known] = FLOOR",
        "in the picture of what changed all floor looks as if both maps had seen it",
    ),
    Mutant(
        "merge/sessions/picture.py",
        "    picture[before.is_occupied & after.is_occupied] = INK\n",
        "    picture[before.is_occupied | after.is_occupied] = INK\n",
        "in the picture of what changed a wall that one map only shows looks like one of both",
    ),
    Mutant(
        "merge/sessions/picture.py",
        "    picture[before.is_occupied | after.is_occupied] = FAINT\n",
        "",
        "in the picture of what changed walls that one map only shows are missing",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "found = changes(one, two, near_m)",
        "found = changes(one, two)",
        "--near counts for nothing",
    ),
    Mutant(
        "merge/sessions/one_map.py",
        "T_team_key = saved.grid, se2.compose(T_team_map, saved.keyframes.T_map_base)",
        "T_team_key = saved.grid, saved.keyframes.T_map_base",
        "a session that is turned but not bent leaves its keyframes elsewhere",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "connectivity=8",
        "connectivity=4",
        "strokes of one thing that face each other across a corner are two pieces",
    ),
    Mutant(
        "merge/sessions/thinning.py",
        "for k in scans.shown[::-1].tolist() or range(count - 1, -1, -1):",
        "for k in range(count - 1, -1, -1):",
        "saved maps keep keyframes that nothing can be matched with",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "warp(two, np.zeros(3), one.resolution_m)",
        "warp(two, np.zeros(3))",
        "of two maps of different resolution everything has changed",
    ),
    Mutant(
        "merge/sessions/diff.py",
        'grid.centres(mask)[np.argsort(labels, kind="stable")]',
        "grid.centres(mask)",
        "pieces of change are said to be where others are",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "(sizes > 0) & (sizes",
        "(sizes",
        "mrslam diff of all changes, however small, tells of a piece of no size",
    ),
)
