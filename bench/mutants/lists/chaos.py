"""Mutants that chaos missions must catch, whatever the tests of a package say."""

from bench.mutants.mutant import Mutant

ANY, LIAR, KIDNAPPED = 1, 18, 83
"""Seeds of missions: the first of all with a merge, with a liar whose turned map fits the walls, and with a
robot that is carried off in arena2."""

MUTANTS = (
    Mutant(
        "agent/team.py",
        "if (found := belief.weighed_alignment) is not None}",
        "if (found := belief.weighed_alignment) is not None and False}",
        "nothing is ever aligned",
        chaos=3,
    ),
    Mutant(
        "agent/team.py",
        "            self._map = replace(team, grid=self.without_ghosts(team.grid), unplaced=unplaced)",
        "            self._map = replace(team, grid=self.maps[self.robot_id].grid)",
        "the team map shows only the own map",
        chaos=ANY,
    ),
    Mutant(
        "mutual_detection/mask.py",
        "    count = int(np.count_nonzero(beams))\n",
        "    count = 0\n",
        "teammates are never masked",
        chaos=ANY,
    ),
    Mutant(
        "agent/self_doubt.py",
        "            if not torn and health >= self.min_health:",
        "            if True:",
        "robots never doubt themselves",
        chaos=KIDNAPPED,
    ),
    Mutant(
        "agent/core.py",
        "                effects = self.team.on_joined(job, outcome, now_ns)\n",
        "                for name, T_team_key in list(outcome.T_team_key.items())[1:]:\n"
        "                    T_team_key[:, 0] += 0.8 + 0.1 * len(name)\n"
        "                effects = self.team.on_joined(job, outcome, now_ns)\n",
        "joint solutions put teammates a metre off",
        chaos=ANY,
    ),
    Mutant(
        "agent/team.py",
        "contradicts_itself(known.local, before) if robot_id != self.robot_id else None",
        "None",
        "liars are not doubted",
        chaos=LIAR,
    ),
    Mutant(
        "agent/map_check.py",
        "    if shown < (ON_WALLS_KNOWN if is_known else ON_WALLS):",
        "    if False:",
        "a map may show another place than its scans",
        chaos=LIAR,
    ),
    Mutant(
        "agent/core.py",
        "if self.mapper.stats.processed and not self.self_doubt.doubtful:",
        "if self.mapper.stats.processed:",
        "a doubtful robot publishes its map",
        chaos=KIDNAPPED,
    ),
)
