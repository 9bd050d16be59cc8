"""Mutants of bodies that are other teammates: they speak for no place."""

from bench.mutants.mutant import Mutant

OWN, ENCOUNTERS, WEIGHED = "agent/own_sightings.py", "agent/encounters.py", "mutual_detection/encounters.py"

MUTANTS = (
    Mutant(
        WEIGHED,
        " and not _is_another(moment.bodies_m, place_m, others_m(moment))",
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
    Mutant(OWN, "None if name == peer else ", "", "a teammate that is placed explains its own body away"),
    Mutant(
        OWN,
        "if T_own_map is not None and team.maps[name].epoch == epoch:",
        "if T_own_map is not None:",
        "a teammate that begins a new map explains bodies away by its place in the old one",
    ),
    Mutant(
        OWN,
        "            if (belief := team.beliefs.get(pair)) is not None:  # else its map contradicts itself by now\n",
        "            if belief := team.beliefs[pair]:\n",
        "a teammate's map that contradicts itself ends a robot that has just seen it",
    ),
    Mutant(
        OWN,
        "        return not self._placed <= before",
        "        return False",
        "a body that turns out to be a teammate placed since still speaks for another's place",
    ),
    Mutant(
        OWN,
        "self._encounters.radius_m, partial(_others_m, team, peer))",
        "self._encounters.radius_m)",
        "bodies are told apart only when a place is new",
    ),
    Mutant(
        OWN,
        "        self._fresh.clear()\n",
        "",
        "one sighting counts again with every look",
    ),
)
