"""Mutants of what `bench.hotel` counts in buildings that repeat themselves."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "bench/hotel.py",
        "        self.wrong_s += EVERY_NS / 1e9\n",
        "",
        "wrong places cost no time",
    ),
    Mutant(
        "bench/hotel.py",
        "        self.right[pair] = not is_false_merge(off_m, off_deg)\n",
        "        self.right[pair] = True\n",
        "no place is ever wrong",
    ),
    Mutant(
        "bench/hotel.py",
        "            self.longest_s[pair] = max(self.longest_s[pair], held_s)\n",
        "            self.longest_s[pair] = held_s if False else 0.0\n",
        "a place that stays wrong after the robots met is not told from one before",
    ),
    Mutant(
        "bench/hotel.py",
        "team.simulation.radio.walls(a, b) == 0",
        "False",
        "no robots ever meet",
    ),
    Mutant(
        "bench/hotel.py",
        """    rows = [row for row in rows if not row.get("died")]\n    waits""",
        """    rows = [row for row in rows if not row.get("died")][:1]\n    waits""",
        "the line of a run is of its first mission",
    ),
    Mutant(
        "bench/hotel.py",
        'return 1 if line["died_seeds"] or len(rows) < len(seeds) else 0',
        "return 0",
        "a run that lost missions passes",
    ),
    Mutant(
        "bench/hotel.py",
        "        if now_ns % LIE_NS:\n",
        "        if now_ns % 1:\n",
        "the liar of a run lies without a pause",
    ),
)
