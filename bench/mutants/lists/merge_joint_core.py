"""Mutants of merge/joint: which keyframes a solution moves, and what the others follow."""

from bench.mutants.mutant import Mutant

TRAIL = "merge/joint/trail.py"
MUTANTS = (
    Mutant(
        TRAIL,
        "        is_inner[1:-1] &= is_bare[:-2] & is_bare[2:]\n",
        "",
        "where a robot came back to what it knows its loop does not close",
    ),
    Mutant(
        TRAIL,
        "        if self.part_of is not None:\n",
        "        if False:\n",
        "a place that was seen again after a way through what is known is none",
    ),
    Mutant(
        TRAIL,
        "<= count]",
        ">= 0]",
        "scans from before and after a long way are matched as if they were taken side by side",
    ),
    Mutant(
        TRAIL,
        "            follows[is_inner] = follows[shown[nearest]]\n",
        "            follows[is_inner] = follows[shown[0]]\n",
        "poses in what is known follow a keyframe at the other end of the building",
    ),
    Mutant(
        TRAIL,
        "        is_inner = is_bare & bool(shown.size)",
        "        is_inner = is_bare & False",
        "solutions cost with the time that robots drive about in what they know",
    ),
    Mutant(
        TRAIL,
        "is_bare & bool(shown.size)",
        "is_bare",
        "maps whose keyframes have no scans are not joined with others, but end the program",
    ),
    Mutant(
        TRAIL,
        "        T_core_key = se2.between(self.trail.T_map_key[self.follows], whole.T_map_key)",
        "        T_core_key = np.zeros_like(whole.T_map_key)",
        "robots stand still in the team map while they drive through what is known",
    ),
    Mutant(
        "merge/joint/join.py",
        "match=tie.match._replace(i=int(i), j=int(j))",
        "match=tie.match",
        "ties are drawn, and believed, between other keyframes than those that match",
    ),
    Mutant(
        "merge/joint/ways.py",
        "starts[tie.b] + follows[tie.b][tie.match.j]",
        "starts[tie.b] + tie.match.j",
        "ties lead to another robot's way, and contradictions near them are overlooked",
    ),
    Mutant(
        "merge/joint/ways.py",
        "        self._follows = {name: core.follows for name, core in cores.items()}\n",
        "        self._cores, self._follows = cores, {name: core.follows for name, core in cores.items()}\n",
        "a solution keeps all that was computed for trails that are no more",
    ),
)
