"""Mutants of alignment, without those of its kernels, proposals and verification."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "alignment/align.py",
        "rivals if prior is None else None)",
        "None)",
        "a hint is believed though the maps fit elsewhere as well",
    ),
    Mutant(
        "alignment/align.py",
        "return [c for c in found if _within(prior, c.T_a_b, a, b)] or [Candidate(prior.T_a_b)]",
        "return list(found)",
        "a known place does not keep maps from being merged elsewhere",
    ),
    Mutant(
        "alignment/align.py",
        "proposed(method), method, config, None if method == EXHAUSTIVE else rivals)",
        "proposed(method), method, config, None)",
        "methods that find one place never ask whether there are more",
    ),
    Mutant(
        "alignment/align.py",
        "outcome, T_a_b=se2.inverse(outcome.T_a_b)",
        "outcome, T_a_b=outcome.T_a_b",
        "where the second map is the larger one, maps are merged inside out",
    ),
    Mutant(
        "alignment/warm_up.py",
        "    align(grid, grid, config=AlignmentConfig(min_score_m=1e6))",
        "    pass",
        "a robot waits seconds for the compiler when two maps first need bending",
    ),
    Mutant(
        "alignment/stability.py",
        "if valid and (self.believed is None or estimate.confidence >= self.believed.confidence):",
        "if valid:",
        "a better alignment is replaced by a worse one",
    ),
    Mutant(
        "alignment/stability.py",
        "valid = self.previous is not None and self.agrees(estimate, self.previous)",
        "valid = True",
        "one alignment that nothing confirms is believed",
    ),
    Mutant(
        "alignment/prepared.py",
        "return sizes[0] < sizes[1] if sizes[0] != sizes[1] else _digest(one) < _digest(two)",
        "return False",
        "align(b, a) is not the inverse of align(a, b)",
    ),
    Mutant(
        "alignment/prepared.py",
        "kept = np.where(inside[: grid.shape[0], : grid.shape[1]], grid.cells, np.int8(UNKNOWN))",
        "kept = grid.cells",
        "a map that shows one place twice is merged by the wrong one",
    ),
    Mutant(
        "alignment/align.py",
        "rivals = tuple(se2.inverse(rival) for rival in outcome.rivals)",
        "rivals = outcome.rivals",
        "where the second map is the larger one, rivals are named inside out",
    ),
    Mutant(
        "alignment/align.py",
        " or [Candidate(prior.T_a_b)]",
        "",
        "robots that saw each other merge maps that contradict it, where walls propose nothing near",
    ),
    Mutant(
        "alignment/repetition.py",
        "reach_m[reach_m > GAP_M].sum()",
        "reach_m.sum()",
        "gaps between beams count as doors to what a map does not show",
    ),
    Mutant(
        "alignment/repetition.py",
        "unseen * max(seldom, repeated_m(known) / known.wall_m)",
        "unseen * seldom",
        "a part of a hotel that shows many equal rooms is taken for all of it",
    ),
    Mutant(
        "alignment/repetition.py",
        "        if math.hypot(*(se2.apply(T, known.centre) - known.centre)) < MOVED_M",
        "        if False and math.hypot(*(se2.apply(T, known.centre) - known.centre)) < MOVED_M",
        "every map repeats itself, for it fits where it is",
    ),
    Mutant(
        "alignment/repetition.py",
        "min(ROOM_M2 / known.known_m2, 1.0)",
        "1.0",
        "in half of a large building nobody is ever localised",
    ),
    Mutant(
        "alignment/align.py",
        "    C = J @ outcome.covariance @ J.T\n",
        "    C = outcome.covariance\n",
        "where the second map is the larger one, a merge is sure in the wrong directions",
    ),
    Mutant(
        "alignment/align.py",
        "evidence = None if outcome.evidence is None else outcome.evidence.swapped()",
        "evidence = outcome.evidence",
        "where the second map is the larger one, a rejection shows each map's evidence as the other's",
    ),
    Mutant(
        "alignment/prepared.py",
        "        while np.count_nonzero(kept := cell % thin == 0) > wall_kernels.NOTHING:\n            thin += 1\n"
        "        return cells[kept], normals[kept]\n",
        "        return cells[::thin].copy(), normals[::thin].copy()\n",
        "of large plans' walls only one side is left, and the same on each",
    ),
    Mutant(
        "alignment/align.py",
        "slack = np.diag([a.res, a.res, a.res / max(math.hypot(*np.ptp(b.points, axis=0)), a.res)]) ** 2",
        "slack = 0.0",
        "where robots started is known exactly, and aligning their maps ends in an error",
    ),
    Mutant(
        "alignment/prepared.py",
        "    if res < 0.8 * config.resolution_m:\n        res = config.resolution_m\n",
        "",
        "maps of cells of a centimetre take minutes to align",
    ),
    Mutant(
        "alignment/prepared.py",
        "while math.prod(size) / res**2 > config.max_cells:",
        "while False:",
        "alignment.max_cells does nothing: maps of a town take all memory",
    ),
    Mutant(
        "alignment/evidence.py",
        "max(self.a.contradicted_m, self.b.contradicted_m) / max",
        "min(self.a.contradicted_m, self.b.contradicted_m) / max",
        "a contradiction counts in the better direction only",
    ),
    Mutant(
        "alignment/evidence.py",
        "return min(self.a.matched_m, self.b.matched_m)",
        "return max(self.a.matched_m, self.b.matched_m)",
        "matched wall counts in the better direction",
    ),
    Mutant(
        "alignment/evidence.py",
        "return replace(self, a=self.b, b=self.a)",
        "return self",
        "evidence of the inverse transform is of the wrong maps",
    ),
    Mutant(
        "alignment/evidence.py",
        "{name: value for name, value in row.items() if name not in named}",
        "{}",
        "what the proposing method said is lost in results",
    ),
    Mutant(
        "alignment/result.py",
        "covariance.shape != (3, 3) or not np.isfinite(covariance).all()",
        "covariance.shape != (3, 3)",
        "a prior with an infinite covariance ends in numpy's error",
    ),
    Mutant(
        "alignment/result.py",
        "not np.allclose(covariance, covariance.T) or ",
        "",
        "half of a prior's covariance is believed where its halves contradict each other",
    ),
    Mutant(
        "alignment/align.py",
        "se2.wrap(T_a_b[2] - prior.T_a_b[2]))\n    slack",
        "T_a_b[2] - prior.T_a_b[2])\n    slack",
        "a prior told with another turn of its heading is passed over",
    ),
    Mutant(
        "alignment/repetition.py",
        "< MOVED_M and abs(se2.wrap(T[2])) < TURNED_RAD",
        "< MOVED_M or abs(se2.wrap(T[2])) < TURNED_RAD",
        "rooms in a row that look alike count as unlike: a place in part of a building is believed",
    ),
    Mutant(
        "alignment/repetition.py",
        "< MOVED_M and abs(se2.wrap(T[2])) < TURNED_RAD",
        "< MOVED_M",
        "the halves of a hall that look alike count as unlike: a place in part of a building is believed",
    ),
)
