"""Mutants of merge: the search of many maps, loops of alignments, fusing and drawing."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "merge/batch/cluster_search.py",
        "        for main, other in combinations(several, 2):",
        "        for main, other in ():",
        "two clusters that fit by one member only stay apart",
    ),
    Mutant(
        "merge/batch/cluster_search.py",
        "        if area < GROWTH * self._tried.get(pair, 0.0):\n            return False",
        "        if pair in self._tried:\n            return False",
        "clusters that have grown are not tried again",
    ),
    Mutant(
        "merge/batch/cluster_search.py",
        "            for _ in range(DENSE_ROUNDS if len(cluster.T_team_map) > 2 else 0):",
        "            for _ in range(0):",
        "a cluster hangs by single alignments",
    ),
    Mutant(
        "merge/batch/cluster_search.py",
        "                vet(self.pairs, part)",
        "                pass",
        "bridges are not checked",
    ),
    Mutant(
        "merge/batch/cluster_search.py",
        "                self.pairs.keep(a, b, seen_from(own, other.T_team_map[b]))",
        "                self.pairs.keep(a, b, own)",
        "maps that fit only together are placed as if one map's frame were the cluster's",
    ),
    Mutant(
        "merge/batch/pair_aligner.py",
        "        self.edges[pair] = result if (a, b) == pair else turned(result)",
        "        self.edges[pair] = result",
        "pairs named the other way round are kept backwards",
    ),
    Mutant(
        "merge/batch/pair_aligner.py",
        "        self.rejections.pop(pair, None)\n        return True",
        "        return True",
        "a pair that was found in the end is still listed as rejected",
    ),
    Mutant(
        "merge/batch/pair_aligner.py",
        "        if not isinstance(result, Rejection) or not {a, b} <= self.trails.keys():",
        "        if True:",
        "maps that fit only when bent are not merged",
    ),
    Mutant(
        "merge/grids/fuse.py",
        "    return np.where(seen, percent, UNKNOWN).astype(np.int8)",
        "    return percent.astype(np.int8)",
        "unknown floor becomes unsure floor",
    ),
    Mutant(
        "merge/grids/fuse.py",
        "CLAMP = 3\n",
        "CLAMP = 30\n",
        "two maps that see a wall are no surer than one",
    ),
    Mutant(
        "merge/draw.py",
        "                layer, T_team_map = BentMap().draw(layer, bend.displacement), bend.T_team_map",
        "                pass",
        "the picture shows bent maps rigid",
    ),
    Mutant(
        "merge/draw.py",
        "from_below, paper = picture[::-1],",
        "from_below, paper = picture,",
        "the picture stands on its head",
    ),
    Mutant(
        "merge/draw.py",
        "    rigid = replace(team_map, bends={}, T_team_map=team_map.T_rigid)",
        "    rigid = team_map",
        "the overlay shows the bent map",
    ),
    Mutant(
        "merge/draw.py",
        "    missing = sorted(team_map.unplaced)",
        "    missing = []",
        "the picture does not say who is not placed",
    ),
    Mutant(
        "merge/graph/consistency.py",
        "            support[pair] += weakest if loop.closes else -weakest",
        "            pass",
        "of a loop that fails a good alignment goes",
    ),
    Mutant(
        "merge/graph/consistency.py",
        "            if not loop.closes and fixed not in pair:",
        "            if not loop.closes:",
        "a known pose is dropped",
    ),
    Mutant(
        "merge/draw.py",
        "    warped = team_map.layers or laid(team_map, layers)",
        "    warped = laid(team_map, layers)",
        "a picture lays all maps again that were fused already",
    ),
    Mutant(
        "merge/draw.py",
        "layers=rigid_layers)",
        "layers=team_map.layers)",
        "the overlay is painted where the bent maps are",
    ),
    Mutant(
        "merge/batch/all_pairs.py",
        "for cluster in pairs.clusters(names):",
        "for cluster in [pairs.cluster(names)]:",
        "of few maps what falls off a cluster is believed unchecked",
    ),
    Mutant(
        "merge/batch/cluster_search.py",
        "return self.pairs.clusters(place)",
        "return [self.pairs.cluster(sorted(place))]",
        "of many maps what falls off a cluster is believed unchecked",
    ),
    Mutant(
        "merge/batch/pair_aligner.py",
        "                rest -= found[-1].T_team_map.keys()\n",
        "                rest.clear()\n",
        "maps that do not hold together with the first one are forgotten",
    ),
)
