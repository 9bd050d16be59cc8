"""Mutants of alignment."""

from bench.mutants.mutant import Mutant

WALKS = "alignment/proposals/walks"

MUTANTS = (
    Mutant(
        f"{WALKS}/aligner.py",
        'return [Candidate(about(row[:3], b), -float(row[3]), {"dissimilarity": float(row[3])}) for row in kept]',
        "return []",
        "five search methods find nothing at all",
    ),
    Mutant(
        f"{WALKS}/random_walk.py",
        "        if len(self._steps) < MEMORY:",
        "        if True:",
        "the adaptive walk never adapts",
    ),
    Mutant(
        f"{WALKS}/annealings.py",
        "if found < value or rng.random() < math.exp(-(found - value) / temperature):",
        "if found < value:",
        "annealing never accepts what is worse",
    ),
    Mutant(
        f"{WALKS}/climbs.py",
        "                now, value = options[k], found[k]\n",
        "                break\n",
        "hill climbing never climbs",
    ),
    Mutant(
        f"{WALKS}/aligner.py",
        "return middle, middle - sigma - (lever, lever, 0.0), middle + sigma + (lever, lever, 0.0)",
        "return middle, np.append(a.points.min(axis=0), -math.pi), np.append(a.points.max(axis=0), math.pi)",
        "walks ignore the prior's window",
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
        "alignment/verification/decide.py",
        "C = covariance(claim.found.H, claim.found.pivot, T_a_b, 0.5 * config.tolerance_m)",
        "C = 1e-12 * covariance(claim.found.H, claim.found.pivot, T_a_b, 0.5 * config.tolerance_m)",
        "every alignment claims to be exact",
    ),
    Mutant(
        "alignment/kernels/settling.py",
        "counts[n, 3], counts[n, 4], counts[n, 5] = matched, opposed, against",
        "counts[n, 3], counts[n, 4], counts[n, 5] = matched, against, opposed",
        "of two hundred places those are followed that lay walls on free space",
    ),
    Mutant(
        "alignment/warm_up.py",
        "    align(grid, grid, config=AlignmentConfig(min_score_m=1e6))",
        "    pass",
        "a robot waits seconds for the compiler when two maps first need bending",
    ),
    Mutant(
        "alignment/verification/fits.py",
        "return max(0.0, 1.0 - max((rivalry(best, rival) for rival in rivals), default=0.0))",
        "return 1.0",
        "corridors that fit at two places are merged at one of them",
    ),
    Mutant(
        "alignment/verification/decide.py",
        "    if claim.passed and confidence >= config.min_confidence:",
        "    if True:",
        "whatever fits best is accepted",
    ),
    Mutant(
        "alignment/verification/reasons.py",
        '        Test(shallow, bounds.contradicted, -0.1, f"',
        '        Test(0.0, bounds.contradicted, -0.1, f"',
        "walls that stand where the other map is free do not count",
    ),
    Mutant(
        "alignment/verification/verify.py",
        "return (self.matched_m + behind) * self.open * math.exp(-share / discount)",
        "return (self.matched_m + behind) * self.open",
        "contradiction makes no fit worse",
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
        "alignment/verification/bending.py",
        "        place, normal, residual = (\n            (at[hit], normal @ R, np.sum(gap * normal, axis=1))",
        "        place, normal, residual = (\n            (at[hit], normal @ R, -np.sum(gap * normal, axis=1))",
        "maps are bent away from each other",
    ),
    Mutant(
        "alignment/verification/decide.py",
        "    return answer(claim.against(others, config, own.case), method, config)",
        "    return answer(claim, method, config)",
        "of a symmetric building whose maps are bent, half a turn is believed",
    ),
    Mutant(
        "alignment/verification/decide.py",
        "    return tuple(claim.rivals[k][1] for share, k in near[:MOST_RIVALS] if 1.0 - share < lead.bound)",
        "    return ()",
        "an ambiguous answer does not say where else the maps fit",
    ),
    Mutant(
        "alignment/align.py",
        "rivals = tuple(se2.inverse(rival) for rival in outcome.rivals)",
        "rivals = outcome.rivals",
        "where the second map is the larger one, rivals are named inside out",
    ),
    Mutant(
        "alignment/verification/reasons.py",
        "config.min_bent_share * wall_m",
        "0.0 * wall_m",
        "a corner that is bent to fit merges two large maps",
    ),
    Mutant(
        "alignment/align.py",
        " or [Candidate(prior.T_a_b)]",
        "",
        "robots that saw each other merge maps that contradict it, where walls propose nothing near",
    ),
    Mutant(
        "alignment/proposals/search.py",
        "+ min(4.0 * lever, 1e6))",
        "+ 0.0)",
        "a known pose far from its map's content has no lever arm",
    ),
    Mutant(
        "alignment/proposals/walks/aligner.py",
        "lever = float(np.hypot(*b.centre)) * sigma[2]",
        "lever = 0.0",
        "walks: a known pose far from its map's content has no lever arm",
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
        "alignment/verification/refine.py",
        "J[0, 2], J[1, 2] = -(T_a_b[1] - pivot[1]), T_a_b[0] - pivot[0]",
        "J[0, 2], J[1, 2] = T_a_b[1] - pivot[1], T_a_b[0] - pivot[0]",
        "a merge of maps far to one side of their origin is sure where it is not",
    ),
)
