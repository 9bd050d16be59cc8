"""Mutants of bodies that are other teammates: they speak for no place."""

from bench.mutants.mutant import Mutant

WITNESS, ENCOUNTERS, WEIGHED = "agent/witness.py", "agent/encounters.py", "mutual_detection/encounters.py"

MUTANTS = (
    Mutant(
        WEIGHED,
        " and not _is_another(moment.bodies_m, place_m, others_m)",
        "",
        "a body that is one teammate speaks for a place of another",
    ),
    Mutant(
        WEIGHED,
        "nearest_m < apart_m.min()",
        "nearest_m < 0.3",
        "of two robots side by side neither is seen",
    ),
    Mutant(
        WEIGHED,
        "bodies_m[apart_m.argmin()]",
        "bodies_m[0]",
        "another body than the one next to the place is asked whose it is",
    ),
    Mutant(
        ENCOUNTERS,
        "        seen.reports[report.peer] = (report.epoch, report.T_map_base)\n",
        "",
        "where other teammates were at an instant is not kept",
    ),
    Mutant(WITNESS, "None if name == peer else ", "", "a teammate that is placed explains its own body away"),
    Mutant(
        WITNESS,
        "if T_own_map is not None and team.maps[name].epoch == epoch:",
        "if T_own_map is not None:",
        "a teammate that begins a new map explains bodies away by its place in the old one",
    ),
    Mutant(
        WITNESS,
        "            if belief is None:\n                continue  # its map contradicts itself by now\n",
        "",
        "a teammate's map that contradicts itself ends a robot that has just seen it",
    ),
    Mutant(
        WITNESS,
        "        if not placed <= self._placed:\n",
        "        if False:\n",
        "a body that turns out to be a teammate placed since still speaks for another's place",
    ),
    Mutant(
        WITNESS,
        "            others_m = self._others_m(team, peer)(moment)\n",
        "            others_m = np.empty((0, 2))\n",
        "bodies are told apart only when a place is new",
    ),
    Mutant(
        WITNESS,
        "        self._fresh.clear()\n\n    def _weigh_again",
        "\n    def _weigh_again",
        "one sighting counts again with every look",
    ),
)
