"""Mutants of the judge of relocalisation."""

from bench.mutants.mutant import Mutant

FILE = "bench/relocalise.py"
MUTANTS = (
    Mutant(
        FILE,
        'row.get("error_m", 0.0) > RIGHT_M or row.get("error_deg", 0.0) > RIGHT_DEG]',
        'row.get("error_m", 0.0) > RIGHT_M]',
        "a robot that is sure of a wrong heading counts as right",
    ),
    Mutant(
        FILE,
        "    wrong = [row for row in own if",
        "    wrong = [row for row in counted if",
        "wrong places of robots that began elsewhere are not counted",
    ),
    Mutant(
        FILE,
        "left = driven[is_known][off_m > KNOWN_M]",
        "left = driven[is_known][:0]",
        "robots that left what was saved are taken to be in it to the end",
    ),
    Mutant(
        FILE,
        'if row["stayed_m"] >= DRIVEN_M]',
        "]",
        "robots that left what was saved at once count as if they had driven 10 m in it",
    ),
    Mutant(
        FILE,
        'if row not in wrong and row["metres"] <= DRIVEN_M]',
        'if row["metres"] <= DRIVEN_M]',
        "wrong places count as found rightly",
    ),
    Mutant(
        FILE,
        'if row not in wrong and row["metres"] <= DRIVEN_M]',
        "if row not in wrong]",
        "robots that drove through half of the building count as found in time",
    ),
    Mutant(
        FILE,
        '"foreign_found": sum(row["found"] for row in foreign)',
        '"foreign_found": sum(not row["found"] for row in foreign)',
        "what was found in foreign buildings is counted the wrong way round",
    ),
    Mutant(
        FILE,
        "(TICK_S if is_simulated else AROUND_S)",
        "AROUND_S",
        "a simulated robot half a metre behind its place counts as right",
    ),
    Mutant(
        FILE,
        "    poses[np.abs(stamps[k] - stamps_ns) > NEAR_S * 1e9] = np.nan\n",
        "",
        "robots are held against where they were long before",
    ),
    Mutant(
        FILE,
        "((t_1, t_2, T_1_2), (t_2, t_1, se2.inverse(T_1_2)))",
        "((t_1, t_2, T_1_2), (t_2, t_1, T_1_2))",
        "relations from the second drive to the first are taken the wrong way round",
    ),
    Mutant(
        FILE,
        " and abs(own[0][j] - stamp_ns) <= WITHIN_S * 1e9:",
        ":",
        "relations of all of the drive say where a robot was then, and its drift counts as an error",
    ),
    Mutant(
        FILE,
        "            if apart_m[k] <= NEAR_M:",
        "            if True:",
        "scans of far places say where a robot was",
    ),
    Mutant(
        FILE,
        "        if len(pairs) < FEW_RELATIONS:",
        "        if False:",
        "robots without relations by hand are not judged",
    ),
    Mutant(
        FILE,
        "    driven = np.append(0.0, np.cumsum(np.hypot(*np.diff(way[1][:, :2], axis=0).T)))",
        "    driven = np.hypot(*(way[1][:, :2] - way[1][0, :2]).T)",
        "what a robot drove is the distance from its start",
    ),
)
