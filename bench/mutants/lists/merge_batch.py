"""Mutants of merge/batch."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "merge/batch/vetting.py",
        "agrees and (isinstance(found, Alignment) or confidence >= SURE)",
        "agrees",
        "a weak bridge stands though the fused maps of both sides do not fit",
    ),
    Mutant("merge/batch/vetting.py", "len(sides) < 2 or edge", "edge", "checking a loop ends in a traceback"),
    Mutant(
        "merge/batch/vetting.py",
        "            del pairs.edges[edge.pair]\n",
        "",
        "a bridge that was refuted goes on to hold the maps together",
    ),
    Mutant(
        "merge/batch/vetting.py",
        "placed = se2.between(place[first(one)], place[first(other)])",
        "placed = se2.between(place[first(other)], place[first(one)])",
        "true bridges fall: the two sides are compared the wrong way round",
    ),
    Mutant(
        "merge/batch/all_pairs.py",
        "return apart <= 0.5 * (one.diameter_m + two.diameter_m) + slack",
        "return apart <= slack",
        "known poses keep maps apart that overlap at their edges",
    ),
    Mutant(
        "merge/batch/all_pairs.py",
        "known = between(T_team_map[a], T_team_map[b],",
        "known = between(T_team_map[b], T_team_map[a],",
        "known poses narrow the search to the wrong place",
    ),
    Mutant(
        "merge/batch/merge_maps.py", "    if not grids:\n", "    if False:\n", "merging no maps ends in a traceback"
    ),
    Mutant(
        "merge/batch/merge_maps.py",
        "        if name not in grids:\n",
        "        if False:\n",
        "a known pose of a map that is not there ends in a traceback",
    ),
    Mutant(
        "merge/batch/pair_aligner.py",
        "self.report(done, len(jobs))",
        "self.report(len(jobs), len(jobs))",
        "progress says at once that all is done",
    ),
    Mutant(
        "merge/batch/all_pairs.py",
        "    if a not in T_team_map or b not in T_team_map:\n        return None",
        "    if a not in T_team_map and b not in T_team_map:\n        return None",
        "a map without a known pose ends in a traceback where another has one",
    ),
    Mutant(
        "merge/batch/merge_maps.py",
        "nearest was {best[0] if best[1] == name else best[1]}",
        "nearest was {best[0]}",
        "a map that is not placed is said to be nearest to itself",
    ),
    Mutant(
        "merge/batch/vetting.py",
        "if agrees and (isinst",
        "if (isinst",
        "a bridge stands though the merged maps of its sides fit elsewhere",
    ),
    Mutant(
        "merge/batch/vetting.py",
        "(isinstance(found, Alignment) or confidence >= SURE)",
        "isinstance(found, Alignment)",
        "a sure bridge falls where the merged maps of its sides fit there without a clear lead",
    ),
    Mutant(
        "merge/batch/vetting.py",
        " and gap_rad < pairs.config.loop_tolerance_rad * 2",
        "",
        "a bridge stands though the merged maps of its sides fit only when turned",
    ),
    Mutant(
        "merge/batch/vetting.py",
        "node_of(other.grid)",
        "node_of(one.grid)",
        "true bridges fall: a small turn is measured at the wrong map's middle",
    ),
    Mutant(
        "merge/batch/pair_aligner.py",
        "config=config, by_parts=scanned)",
        "config=config, by_parts=False)",
        "`mrslam merge` refuses large maps that their scans would bend",
    ),
    Mutant(
        "merge/batch/merge_maps.py",
        'if len(pairs.grids) > 2 else ""',
        'if True else ""',
        "of two maps that do not fit, one is said to be nearest to the other",
    ),
)
