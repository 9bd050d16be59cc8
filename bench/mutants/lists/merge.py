"""Mutants of merge: folders without a list of their own."""

from bench.mutants.mutant import Mutant

GRAPH = "merge/team_graph.py"

MUTANTS = (
    Mutant(
        GRAPH,
        "            elif conflict is not None and (reason := conflict(*pair, edge.T_a_b, 1)):\n",
        "            elif reason := None:\n",
        "walls on free floor do not take a merge back",
    ),
    Mutant(
        GRAPH,
        "            if reason and (wrong := weakest(tree, between)) is not None:",
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
        "merge/contradictions.py",
        "if found.share_against <= self.config.contradiction_share or",
        "if found.share_against <= 1.0 or",
        "no two maps ever contradict each other",
    ),
    Mutant(
        "merge/contradictions.py",
        "if key in held and held[key][0] is maps[0] and held[key][1] is maps[1]:",
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
        "merge/team.py",
        "            self._tiled_maps.pop(robot_id, None)\n",
        "",
        "the team map shows maps as they were first",
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
        "merge/team.py",
        "        if held is None or held[0] is not bend.T_team_key:\n",
        "        if held is None:\n",
        "a joint solution that lays walls on free space is believed after a right one",
    ),
    Mutant(
        "merge/team.py",
        "held[0] is not tiled or held[1] is not bend:",
        "held[0] is not tiled:",
        "the team map stays as it was bent first",
    ),
    Mutant(
        "merge/team.py",
        "held[0] is not tiled or held[1] is not bend:",
        "held[1] is not bend:",
        "a bent map grows in the team map only as it is joined again",
    ),
    Mutant(
        "merge/team_graph.py",
        "return {robot_id: pose.copy() for robot_id, pose in self._solved[1].items()}, self._solved[2]",
        "return self._solved[1], self._solved[2]",
        "the first placement changes the next ones",
    ),
    Mutant(
        "merge/contradictions.py",
        "float(np.sqrt(hops))",
        "1.0",
        "maps that are joined by way of several others are told to contradict each other",
    ),
    Mutant(
        GRAPH,
        "sigma_rad**2]) / self.config.covariance_scale",
        "sigma_rad**2])",
        "alignments move known poses by far more than their doubt",
    ),
    Mutant(
        "merge/team.py",
        "                if (a, b) not in self.bent.met:\n                    return None\n",
        "",
        "walls that two robots saw from afar undo the merges through which their drift adds up",
    ),
    Mutant(
        "merge/contradictions.py",
        "parts = bent.part(a, b, maps[0]), bent.part(b, a, maps[1])",
        "parts = maps",
        "robots in a large place are unmerged for walls that drifted apart far from where they met",
    ),
    Mutant(
        "merge/contradictions.py",
        "if held is None or held[0] is not bent.ways or held[1] is not maps[0] or held[2] is not maps[1]:",
        "if held is None:",
        "bent maps are judged once, whatever comes later",
    ),
    Mutant(
        "merge/batch/merge_maps.py",
        "mapper.graph.set_known_poses(poses)",
        "pass",
        "poses that are known are not used",
    ),
    Mutant(
        "merge/batch/merge_maps.py",
        "if placement.anchor not in known or len(known) < 2:",
        "if len(known) < 2:",
        "maps beside one without a way are said to be bent",
    ),
    Mutant(
        "merge/batch/merge_maps.py",
        "best = max(sorted(tries), key=lambda pair: tries[pair].confidence)",
        "best = sorted(tries)[0]",
        "why a map is not placed is told by any of its tries",
    ),
    Mutant(
        "merge/batch/merge_maps.py",
        "(shown_m2 := pairs.grids[name].known_area_m2()) < MIN_KNOWN_M2",
        "(shown_m2 := pairs.grids[name].known_area_m2()) < 0",
        "a map that shows nothing is said to fit nowhere",
    ),
)
