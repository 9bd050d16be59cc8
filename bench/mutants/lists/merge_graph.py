"""Mutants of merge/graph."""

from bench.mutants.mutant import Mutant

CONSISTENCY, SOLVE = (f"merge/graph/{name}.py" for name in ("consistency", "solve"))

MUTANTS = (
    Mutant(
        "merge/graph/consistency.py",
        "(kept[pair].confidence >= SEEN_CONFIDENCE, support[pair],",
        "(support[pair],",
        "look-alikes that agree with each other outvote robots that saw each other",
    ),
    Mutant(
        "merge/graph/tree.py",
        "return spanning_tree(edges, lambda edge: edge.confidence)",
        "return spanning_tree(edges, lambda edge: -edge.confidence)",
        "maps are placed along the worst alignments: a minimum spanning tree",
    ),
    Mutant(
        CONSISTENCY,
        "tree = spanning_tree(kept, lambda edge: edge.confidence)",
        "tree = spanning_tree(kept, lambda edge: -edge.confidence)",
        "long loops are judged by the worst alignments, and the best ones dropped",
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
        "information / (1.0 + squares / config.robust_sigmas**2)[:, None, None]",
        "information",
        "one wrong alignment bends where all maps lie",
    ),
    Mutant(
        SOLVE,
        "    if len(chosen) <= len(free):\n",
        "    if True:\n",
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
        "merge/graph/carried.py",
        "covariance=J @ found.covariance @ J.T)\n\n\ndef seen_from",
        "covariance=found.covariance)\n\n\ndef seen_from",
        "alignments of merged maps are sure along the wrong axis",
    ),
    Mutant(
        "merge/graph/carried.py",
        "    J_a[:2, 2] = T_a_b[1], -T_a_b[0]\n",
        "",
        "maps whose known starts lie far apart are looked for too near to these",
    ),
    Mutant(
        "merge/graph/carried.py",
        "[[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]]",
        "np.eye(3)",
        "alignments of merged maps are too sure of what lies far away",
    ),
    Mutant(
        "merge/graph/carried.py",
        "lever = se2.matrix(prior.T_a_b)[:2, :2] @ point_b",
        "lever = 0.0 * point_b",
        "maps that touch far from their known starts are not compared",
    ),
    Mutant(
        CONSISTENCY,
        "    bent = config.loop_tolerance_share * max((node.diameter_m for node in nodes), default=0.0)",
        "    bent = 0.0",
        "right alignments of large maps, which are bent, are dropped",
    ),
    Mutant(
        CONSISTENCY,
        "    grows = math.sqrt(max(hops, 3) / 3.0)",
        "    grows = 1.0",
        "right alignments of large teams are dropped: long loops must close as well as triangles",
    ),
    Mutant(
        CONSISTENCY,
        "    limit_m += limit_rad * _lever_m(pairs, nodes, fixed)\n",
        "",
        "a known pose with a heading that is slightly off keeps a map far from its origin out of the team map",
    ),
    Mutant(
        CONSISTENCY,
        "se2.difference_at(T_a_b, direct.T_a_b, nodes[direct.b].centre_m)",
        "se2.difference(T_a_b, direct.T_a_b)",
        "an alignment that lays a map metres off is believed where the map's origin is far away",
    ),
    Mutant(
        "merge/graph/nodes.py",
        "np.array(shape[::-1])",
        "np.array(shape)",
        "loops of maps that are longer than wide are judged beside them",
    ),
    Mutant(
        SOLVE,
        "edge.covariance + FLOOR for",
        "edge.covariance for",
        "an alignment that claims to be exact ends the program",
    ),
    Mutant(
        SOLVE,
        "config.covariance_scale * edge.covariance",
        "edge.covariance",
        "merge.covariance_scale does nothing: gaps of loops fall on one alignment",
    ),
    Mutant(
        "merge/graph/tree.py",
        "    loose = [pair for pair in between if ROOT not in pair]",
        "    loose = list(between)",
        "maps with known starting poses that contradict each other are taken out of the team map",
    ),
    Mutant(
        "merge/graph/edges.py",
        "return self.pair, self.T_a_b.tobytes(), self.covariance.tobytes(), self.confidence",
        "return self.pair, self.covariance.tobytes(), self.confidence",
        "maps stay where they were though their alignment was corrected",
    ),
    Mutant(
        "merge/graph/nodes.py",
        "np.array([col0, row0]) * known.resolution_m",
        "np.array([row0, col0]) * known.resolution_m",
        "loops of robots' maps, which come in tiles, are judged beside them",
    ),
    Mutant(
        SOLVE,
        "    residual[:, 2] = se2.wrap(residual[:, 2])\n",
        "",
        "where maps lie turned by half a turn the gap of a loop falls on one alignment",
    ),
)
