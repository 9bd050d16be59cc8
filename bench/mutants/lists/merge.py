"""Mutants of merge."""

from bench.mutants.mutant import Mutant

GRAPH = "merge/team_graph.py"
CONSISTENCY, SOLVE = (f"merge/graph/{name}.py" for name in ("consistency", "solve"))

CHANGES, THINNING, ONE_MAP, DIFF = (f"merge/sessions/{name}.py" for name in ("changes", "thinning", "one_map", "diff"))

MUTANTS = (
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
        "        covers &= (seen[others] & seen[k]).sum(axis=1) >= SHARED * seen[k].sum()\n",
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
        "    label = np.where(mask, label, 0)\n",
        "",
        "pieces that changed are listed larger than they are",
    ),
    Mutant(
        GRAPH,
        "tree = spanning_tree(inside, lambda edge: edge.confidence)",
        "tree = spanning_tree(inside, lambda edge: -edge.confidence)",
        "maps are placed along the worst alignments: a minimum spanning tree",
    ),
    Mutant(
        CONSISTENCY,
        "tree = spanning_tree(kept, lambda edge: edge.confidence)",
        "tree = spanning_tree(kept, lambda edge: -edge.confidence)",
        "long loops are judged by the worst alignments, and the best ones dropped",
    ),
    Mutant(
        GRAPH,
        "            elif conflict is not None and (reason := conflict(*pair, edge.T_a_b, 1)):\n",
        "            elif reason := None:\n",
        "walls on free floor do not take a merge back",
    ),
    Mutant(
        GRAPH,
        "            if reason and loose:",
        "            if False:",
        "two maps placed through a third may contradict each other",
    ),
    Mutant(
        GRAPH,
        "            for drop_broken in (drop_broken_triangles, drop_broken_loops):",
        "            for drop_broken in (drop_broken_loops,):",
        "one wrong alignment among three is not found out by the two others",
    ),
    Mutant(
        GRAPH,
        "        return max(groups, key=size, default=[])  # the first of equals",
        "        return min(groups, key=size, default=[])",
        "without an anchor the smallest group of maps is shown",
    ),
    Mutant(
        GRAPH,
        "            if pair[0] not in self._nodes or pair[1] not in self._nodes:\n                continue",
        "            if False:\n                continue",
        "an alignment with a robot whose map is not known stops the team map",
    ),
    Mutant(
        CONSISTENCY,
        "support[pair] += weakest if loop.closes else -weakest",
        "support[pair] += weakest",
        "of a broken loop the good alignment goes",
    ),
    Mutant(
        CONSISTENCY,
        "    limit_m, limit_rad = tolerance(config, (nodes[x] for x in ids), len(pairs))\n",
        "    limit_m, limit_rad = math.inf, math.inf\n",
        "loops of alignments need not close",
    ),
    Mutant(
        SOLVE,
        "weight = 1.0 / (1.0 + float(residual @ info @ residual) / config.robust_sigmas**2)",
        "weight = 1.0",
        "one wrong alignment bends where all maps lie",
    ),
    Mutant(
        SOLVE,
        "    if len(chosen) <= len(ids):\n        return poses",
        "    if True:\n        return poses",
        "loops between maps correct nothing",
    ),
    Mutant(
        "merge/graph/edges.py",
        "T_a_b, covariance = se2.inverse(T_a_b), inverse_covariance(T_a_b, covariance)",
        "covariance = inverse_covariance(T_a_b, covariance)",
        "an alignment told the other way round is used as it is",
    ),
    Mutant(
        "merge/graph/edges.py",
        "return jacobian @ np.asarray(covariance, dtype=np.float64) @ jacobian.T",
        "return np.asarray(covariance, dtype=np.float64)",
        "the uncertainty of a turned alignment points the wrong way",
    ),
    Mutant(
        "merge/grids/agreement.py",
        "        elif 0 <= cells[r, c] <= FREE_MAX:\n            against += 1",
        "        elif 0 <= cells[r, c] <= FREE_MAX:\n            agree += 1",
        "contradicting maps seem to agree",
    ),
    Mutant(
        "merge/grids/fuse_kernels.py",
        "                out[i, j] = a + b",
        "                out[i, j] = min(a, b)",
        "one robot's glimpse of a free cell clears another's wall",
    ),
    Mutant(
        "merge/grids/fusion_tree.py",
        "            del self._made_of[index], self.cells[index], self._nodes[index]\n",
        "            pass\n",
        "an unmerged map stays in the team map",
    ),
    Mutant(
        "merge/grids/fusion_tree.py",
        "            if self._made_of.get(index) == versions:",
        "            if index in self._made_of:",
        "the team map does not follow maps that change",
    ),
    Mutant(
        "merge/grids/layers.py",
        "        before = self._grid if same_place else None",
        "        before = self._grid",
        "a map that is placed anew stays where it was in the team map",
    ),
    Mutant(
        "merge/grids/warp_kernels.py",
        "    if value >= OCCUPIED and draws_thin and not is_thick(cells, r, c):\n"
        "        return _beside(cells, r, c, sx - c - 0.5, sy - r - 0.5)\n",
        "",
        "thin walls get thick in the team map",
    ),
    Mutant(
        "merge/contradictions.py",
        "        near_m = self.config.contradiction_tolerance_m * float(np.sqrt(hops))",
        "        near_m = 1e3",
        "no two maps ever contradict each other",
    ),
    Mutant(
        "merge/contradictions.py",
        "if key in held and held[key][0] is grids[0] and held[key][1] is grids[1]:",
        "if key in held:",
        "maps that come to contradict each other are not compared again",
    ),
    Mutant(
        "merge/team.py",
        "            if {a, b} <= self._scanned and not self.bent.judges(a, b, T_a_b):\n                return None\n",
        "",
        "bent maps are unmerged before they could be joined",
    ),
    Mutant(
        "merge/team.py",
        "if placement.anchor not in bends or not bends.keys() <= places.keys():",
        "if placement.anchor not in bends:",
        "who was unmerged still bends the map",
    ),
    Mutant(
        "merge/joint/consistent.py",
        "    return np.asarray(closes & closes.T)",
        "    return np.ones_like(closes)",
        "matches that contradict each other are all believed",
    ),
    Mutant(
        "merge/joint/join.py",
        "        if best.keep.size < CLEAR * best.rival:",
        "        if False:",
        "where two answers are as good as each other one is believed",
    ),
    Mutant(
        "merge/joint/join.py",
        "        if best.keep.size < MATCHES_LEAST:",
        "        if False:",
        "a single match ties two robots",
    ),
    Mutant(
        "merge/joint/join.py",
        "    names = [name for name in sorted(trails) if",
        "    names = [name for name in trails if",
        "the same knowledge in another order gives another map",
    ),
    Mutant(
        "merge/joint/local_match.py",
        " if fits(found) else None",
        "",
        "places that do not fit tie robots",
    ),
    Mutant(
        "merge/joint/bend.py",
        "        moved = se2.apply(T, points[:, None, :]) - points[:, None, :]",
        "        moved = 0.0 * points[:, None, :] + np.zeros_like(near)[..., None]",
        "maps are not bent where keyframes were corrected",
    ),
    Mutant(
        "merge/joint/bend_kernels.py",
        "                _push_walls(cells, field, (i, j, reach), out)",
        "                pass",
        "walls get holes where a map is bent",
    ),
    Mutant(
        "merge/joint/align_bent.py",
        "    if isinstance(outcome, Rejection):\n        return replace(",
        "    if isinstance(outcome, Rejection) and False:\n        return replace(",
        "what bends until it fits is believed without being looked at",
    ),
    Mutant(
        "spatial/pose_graph.py",
        "    weight = np.where(doubtful & (edges.chi2(poses) > bound), 0.0, 1.0)\n    _settle(",
        "    weight = np.ones(edges.first.size)\n    _settle(",
        "one wrong match bends a whole map",
    ),
    Mutant(
        "spatial/pose_graph.py",
        "        if (tried <= weight).all():",
        "        if True:",
        "a wrong match that agreed by chance takes right ones with it",
    ),
    Mutant(
        "merge/joint/join.py",
        "poses, chosen, others(found, chosen))",
        "poses, chosen)",
        "a right match that a wrong one kept out of the largest set is lost",
    ),
    Mutant(
        "merge/joint/join.py",
        "PASSES = 2",
        "PASSES = 1",
        "two robots that know the same see different maps",
    ),
    Mutant(
        "merge/joint/join.py",
        "        T_own_team = rigid(T_map_key, self.T_team_key[robot_id])",
        "        T_own_team = se2.between(se2.inverse(T_map_key[0]), se2.inverse(self.T_team_key[robot_id][0]))",
        "one keyframe's heading turns the whole team map",
    ),
    Mutant(
        "merge/joint/join.py",
        "        for _ in range(ROUNDS):",
        "        for _ in range(1):",
        "drifted maps are tied only where they met first",
    ),
    Mutant(
        "merge/sessions/diff.py",
        "        if k == 0:\n            continue\n",
        "",
        "everything that did not change is a piece",
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
)
