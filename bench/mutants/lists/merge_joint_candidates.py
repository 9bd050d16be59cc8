"""Mutants of merge/joint: which keyframes are compared."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "merge/joint/candidates.py",
        "np.flatnonzero(away_m <= within_m(lost_m))",
        "np.flatnonzero(away_m <= FAR_MOST_M)",
        "keyframes metres apart are compared, next to matches that say where they are",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "        if _is_far(done_m, way_m, 0.5 * COMPARED_EVERY_M):\n",
        "        if True:\n",
        "what was matched is matched again in every round",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "        lost_m = (to_a + to_b).min(axis=0)\n",
        "",
        "far from any match as little is looked for as next to it",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "        if way_m - last_m < COMPARED_EVERY_M:\n            continue\n",
        "",
        "joining takes five times as long",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "shown = a.scans.shown, b.scans.shown",
        "shown = np.arange(len(a)), b.scans.shown",
        "places are compared with keyframes that came without scans",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "shown = a.scans.shown, b.scans.shown",
        "shown = a.scans.shown, np.arange(len(b))",
        "keyframes that came without scans are compared",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "(to_a + to_b).min(axis=0)",
        "(to_a + to_b).max(axis=0)",
        "next to a match keyframes are looked for as far as the farthest one lets them drift",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "a.way_between(np.array([match.i for",
        "a.way_between(np.array([match.j for",
        "how far the first robot may have drifted is counted from the other robot's keyframe",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "b.way_between(np.array([match.j for",
        "b.way_between(np.array([match.i for",
        "how far the second robot may have drifted is counted from the other robot's keyframe",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "(to_a + to_b)",
        "(2.0 * to_b)",
        "the drift of the first robot is taken for that of the second",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "se2.between(T_a[i[k]], T_b[j[k]])",
        "T_b[j[k]] - T_a[i[k]]",
        "keyframes of a robot that does not look along +x are searched for in the wrong place",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "    for k in np.flatnonzero(away_m <= within_m(lost_m)).tolist():\n        way_m = b.way_m[j[k]]\n",
        "    for k in range(j.size):\n        way_m = b.way_m[j[k]]\n        if away_m[k] > within_m(lost_m)[k]:\n"
        "            last_m = way_m\n            continue\n",
        "a keyframe that is too far keeps the next ones from being compared",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "done_m[max(k - 1, 0) : k + 1]",
        "done_m[k : k + 1]",
        "what was matched a little earlier on the way is matched again",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "done_m[max(k - 1, 0) : k + 1]",
        "done_m[max(k - 1, 0) : k]",
        "what was matched a little later on the way is matched again",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "nearest_keys(T_a[shown[0]], T_b[shown[1]], TURN_COST_M,",
        "nearest_keys(T_a[shown[0]], T_b[shown[1]], 0.0,",
        "a keyframe is compared with one that looked the other way, next to one that looked the same way",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "[b.way_m[j] for _, j in found]",
        "[b.way_m[j] for j, _ in found]",
        "what was matched is compared again, and what was not is left out",
    ),
    Mutant(
        "merge/joint/candidates.py",
        "(apart <= FAR_MOST_M).all()",
        "(apart <= 0.0).all()",
        "robots that drove side by side are never compared",
    ),
    Mutant(
        "merge/joint/candidate_kernels.py",
        "min(turn, 2.0 * math.pi - turn)",
        "turn",
        "keyframes that look a little over and under half a turn count as opposed",
    ),
    Mutant(
        "merge/joint/candidate_kernels.py",
        "if dx * dx + dy * dy >= least * least:",
        "if dx * dx + dy * dy >= least:",
        "the nearest keyframe is not found within a metre",
    ),
    Mutant(
        "merge/joint/candidate_kernels.py",
        "if aside * aside + ahead * ahead >= least * least:",
        "if aside * aside + ahead * ahead >= least:",
        "a stretch of way metres aside is passed over though the nearest keyframe is on it",
    ),
    Mutant(
        "merge/joint/candidate_kernels.py",
        "min((block + 1) * BLOCK, len(T_a))",
        "min((block + 1) * BLOCK, len(T_a) - 1)",
        "the last keyframe is compared with none",
    ),
    Mutant(
        "merge/joint/candidate_kernels.py",
        "least = most_m + turn_cost_m * math.pi",
        "least = most_m",
        "a keyframe that looked the other way is compared with none though it is near",
    ),
    Mutant(
        "merge/joint/candidate_kernels.py",
        "= cost, i, away",
        "= cost, i, cost",
        "keyframes that look elsewhere count as far away",
    ),
)
