"""Mutants of agent."""

from bench.mutants.mutant import Mutant

CORE, ROBOT, TEAM, TEAMMATES = (f"agent/{name}.py" for name in ("core", "robot", "team", "teammates"))
BELIEF, SCHEDULE, SECOND_LOOK = (f"agent/pairs/{name}.py" for name in ("belief", "schedule", "second_look"))
DOUBT, WITNESS = "agent/self_doubt.py", "agent/witness.py"
HYPOTHESES, WEIGHING = (f"agent/pairs/{name}.py" for name in ("hypotheses", "weighing"))

MUTANTS = (
    Mutant(
        "agent/pairs/belief.py",
        "self.barren + 1 if is_barren else 0)",
        "self.barren + 1)",
        "a robot in the building of its saved map says that it is elsewhere",
    ),
    Mutant(
        "agent/pairs/schedule.py",
        "        if turned := sure[b] > sure[a]:\n",
        "        if turned := False:\n",
        "a hint without a heading is looked for about the wrong place",
    ),
    Mutant(
        TEAMMATES,
        "        if not self._enabled:\n            return scan, 0",
        "        if True:\n            return scan, 0",
        "teammates are not masked",
    ),
    Mutant(
        TEAMMATES,
        "place = se2.compose(T_own_peer, report.T_map_base)[:2]",
        "place = report.T_map_base[:2]",
        "a teammate's place is taken in its own map's frame",
    ),
    Mutant(
        CORE,
        "if self.mapper.stats.processed and not self.self_doubt.doubtful:",
        "if self.mapper.stats.processed:",
        "a doubtful robot publishes its map",
    ),
    Mutant(
        CORE,
        "        effects += self.team.revoke(now_ns)\n",
        "",
        "contradicted merges are never taken back on a tick",
    ),
    Mutant(
        CORE,
        "if known is not None and known.epoch == report.epoch:",
        "if known is not None:",
        "a place on a teammate's new map is taken for one on its old map",
    ),
    Mutant(
        CORE,
        "        self.node.begin_map()\n",
        "",
        "a map begun anew goes out as if it were the old one gone on",
    ),
    Mutant(
        CORE,
        "        self.team.displace(self.robot_id)\n",
        "",
        "after a map is begun anew teammates stay where they lay on the old one",
    ),
    Mutant(
        CORE,
        "return self._published_ns is None or now_ns - self._published_ns >= interval_ns",
        "return self._published_ns is None",
        "a robot publishes its first map only",
    ),
    Mutant(
        CORE,
        "return se2.compose(self.mapper.T_map_base, se2.between(self._T_odom_base, T_odom_base))",
        "return self.mapper.T_map_base",
        "on a robot that turns, teammates are masked where they were a scan before",
    ),
    Mutant(
        ROBOT,
        "return self.team_map().grid if len(self.T_team_map) > 1 else self.own_map()",
        "return self.own_map()",
        "robots explore what their team has explored already",
    ),
    Mutant(
        TEAMMATES,
        "if peer in T_team_map and now_ns - report.stamp_ns < REPORT_VALID_NS",
        "if peer in T_team_map",
        "robots keep away from where a teammate was an hour ago",
    ),
    Mutant(
        ROBOT,
        "se2.compose(trajectory.T_map_base, T_base_laser)",
        "trajectory.T_map_base",
        "the trajectory written is not the laser's",
    ),
    Mutant(
        TEAMMATES,
        "            self._tracker.forget(lost)\n",
        "            pass\n",
        "a teammate that was unmerged is masked on",
    ),
    Mutant(
        TEAM,
        "        if self._doubts(robot_id, known):\n            return",
        "        if False:\n            return",
        "a map that contradicts itself is believed",
    ),
    Mutant(
        TEAM,
        "replace(team, grid=self.without_ghosts(team.grid), unplaced=unplaced)",
        "replace(team, unplaced=unplaced)",
        "ghosts stay in the team map",
    ),
    Mutant(
        TEAM,
        "        self.beliefs |= {pair: belief for pair",
        "        _ = {pair: belief for pair",
        "after a restart a robot has to find its teammates again",
    ),
    Mutant(
        BELIEF,
        "        if self.alignment is None and is_echo(self.stability, outcome):",
        "        if False:",
        "weak evidence looked at twice is believed",
    ),
    Mutant(
        TEAM,
        "            self._begin_pairs(robot_id)\n",
        "",
        "a robot's new map is merged as its old one was",
    ),
    Mutant(
        BELIEF,
        "        return reason or refuted(self.alignment, outcome)",
        "        return reason",
        "merged maps that come to contradict each other stay merged",
    ),
    Mutant(
        TEAM,
        "            if robot_id not in self.maps or self.maps[robot_id].epoch != version[0]:",
        "            if False:",
        "an alignment of a map that was given up is used for the new one",
    ),
    Mutant(
        SCHEDULE,
        "            return _grown(maps, last.area_m2, self.config.align_growth)",
        "            return False",
        "a pair that was rejected once is never tried again",
    ),
    Mutant(
        DOUBT,
        "            if not torn and health >= self.min_health:",
        "            if True:",
        "robots never doubt themselves",
    ),
    Mutant(
        DOUBT,
        "        if self._doubted_ns >= self.give_up_ns:",
        "        if False:",
        "a robot that is lost never begins a new map",
    ),
    Mutant(
        TEAM,
        "return robot_id == self.robot_id and goes_on and not self._is_own_frame_new",
        "return False",
        "a robot that has to label its map anew loses its own merges",
    ),
    Mutant(
        TEAM,
        "return robot_id == self.robot_id and goes_on and not self._is_own_frame_new",
        "return robot_id == self.robot_id and goes_on",
        "merges of a map that was given up are kept for the next one",
    ),
    Mutant(
        "agent/map_check.py",
        "    if free < ON_FREE:",
        "    if False:",
        "liars are not doubted",
    ),
    Mutant(
        "agent/map_check.py",
        "    if shown < ON_WALLS:",
        "    if False:",
        "a map that is turned in an open hall shows its robot and its way elsewhere",
    ),
    Mutant(
        DOUBT,
        "            if self._fitting < FITTING_LEAST:\n                return False",
        "            if False:\n                return False",
        "a robot that was carried off believes itself again wherever it is",
    ),
    Mutant(
        SECOND_LOOK,
        "    if searched.evidence is None or searched.evidence.margin >= AMBIGUOUS_MARGIN:",
        "    if True:",
        "a merge in a house that looks alike is never taken back",
    ),
    Mutant(
        "agent/blindness.py",
        "        if self._blind or now_ns - self._seen_ns < BLIND_NS:",
        "        if True:",
        "nobody hears of a laser that is of no use",
    ),
    Mutant(
        "agent/checkpoint.py",
        "        mapper.skip_revisions(REVISIONS_LOST)\n",
        "",
        "after a crash one revision stands for two maps",
    ),
    Mutant(
        "agent/checkpoint.py",
        "        agent.node.store.new_epoch()\n",
        "        pass\n",
        "with a full disk a second crash gives two maps one revision",
    ),
    Mutant(
        "agent/team.py",
        "            return []  # a map was started anew while this was computed\n",
        "            pass\n",
        "a solution of maps that are gone bends those that came after",
    ),
    Mutant(
        "agent/joining.py",
        "        if believed == self._T_a_b and not self._is_due(keys, now_ns):",
        "        if not self._is_due(keys, now_ns):",
        "a new merge waits to be joined and judged",
    ),
    Mutant(
        "agent/joining.py",
        "        if waited_ns < JOIN_NS or keys == self._keys:",
        "        if waited_ns < JOIN_NS:",
        "what is known is joined again for nothing",
    ),
    Mutant(
        "agent/core.py",
        "self.team.T_own_map(report.peer)",
        "self.T_team_map.get(report.peer)",
        "teammates are masked where the own map is bent away from",
    ),
    Mutant(
        WITNESS,
        "if place is not None and place.is_refuted:",
        "if False:",
        "a pair whose robots looked in vain for each other stays merged",
    ),
    Mutant(
        WEIGHING,
        "if here is not None and here.is_refuted:",
        "if False:",
        "a place where nobody was is believed again as soon as the maps propose it",
    ),
    Mutant(
        WEIGHING,
        "    return against_m <= max(FORGIVEN_M, FORGIVEN_SHARE * evidence.matched_m)",
        "    return True",
        "robots that saw someone else at one distance merge through walls",
    ),
    Mutant(
        HYPOTHESES,
        "return (0.0 if self.own is None else self.own.llr) + sum(self.told.values())",
        "return 0.0 if self.own is None else self.own.llr",
        "what teammates saw is not weighed",
    ),
    Mutant(
        HYPOTHESES,
        "key=lambda one: (abs(one.llr), one.proposed_ns))",
        "key=lambda one: one.proposed_ns)",
        "what was refuted is forgotten as soon as five other places were proposed",
    ),
    Mutant(
        BELIEF,
        "searched &= here is None or not here.is_supported",
        "searched &= True",
        "robots that see each other are unmerged because another wing looks alike",
    ),
    Mutant(
        CORE,
        "        self.node.add_claims(self._witness.claims(self.team, now_ns))\n",
        "",
        "robots do not tell each other what they saw",
    ),
)
