"""Mutants of agent."""

from bench.mutants.mutant import Mutant

CORE, TEAM, PAIRS, DOUBT = (f"agent/{name}.py" for name in ("core", "team", "pairs", "doubt"))

MUTANTS = (
    Mutant(
        CORE,
        "        if not self.settings.mutual_detection.enabled:\n            return scan, 0",
        "        if True:\n            return scan, 0",
        "teammates are not masked",
    ),
    Mutant(
        CORE,
        "self.tracker.observe(seen.peer, seen.stamp_ns, se2.compose(T_own_peer, seen.T_map_base)[:2])",
        "self.tracker.observe(seen.peer, seen.stamp_ns, seen.T_map_base[:2])",
        "a teammate's place is taken in its own map's frame",
    ),
    Mutant(
        CORE,
        "if not self.self_doubt.doubtful and self.mapper.stats.processed:",
        "if self.mapper.stats.processed:",
        "a doubtful robot publishes its map",
    ),
    Mutant(
        CORE,
        "        return effects + self.team.revoke(now_ns)\n\n    def _known",
        "        return effects\n\n    def _known",
        "contradicted merges are never taken back on a tick",
    ),
    Mutant(
        CORE,
        "        if seen.epoch != self.node.store.version(seen.peer)[0]:\n            return",
        "        if False:\n            return",
        "a place on a teammate's new map is taken for one on its old map",
    ),
    Mutant(
        CORE,
        "            self.node.begin_map()\n",
        "",
        "a map begun anew goes out as if it were the old one gone on",
    ),
    Mutant(
        CORE,
        "            self.team.displace(self.robot_id)\n",
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
        CORE,
        "return self.team_map().grid if len(self.T_team_map) > 1 else self.own_map()",
        "return self.own_map()",
        "robots explore what their team has explored already",
    ),
    Mutant(
        CORE,
        "if peer in self.T_team_map and now_ns - t_ns < TEAMMATE_NS",
        "if peer in self.T_team_map",
        "robots keep away from where a teammate was an hour ago",
    ),
    Mutant(
        CORE,
        "se2.compose(trajectory.T_map_base, self._T_base_laser)",
        "trajectory.T_map_base",
        "the trajectory written is not the laser's",
    ),
    Mutant(
        TEAM,
        "            self._on_lost(lost)\n",
        "            pass\n",
        "a teammate that was unmerged is masked on",
    ),
    Mutant(
        TEAM,
        "if robot_id != self.robot_id and self._doubts(robot_id, local):\n            return",
        "if False:\n            return",
        "a map that contradicts itself is believed",
    ),
    Mutant(
        TEAM,
        "            self._map = replace(team, grid=self.without_ghosts(team.grid))",
        "            self._map = team",
        "ghosts stay in the team map",
    ),
    Mutant(
        TEAM,
        "            if status.alignment is not None:\n                self._graph.set_edge",
        "            if False:\n                self._graph.set_edge",
        "after a restart a robot has to find its teammates again",
    ),
    Mutant(
        PAIRS,
        "        if status.alignment is None and is_echo(status.stability, outcome):",
        "        if False:",
        "weak evidence looked at twice is believed",
    ),
    Mutant(
        PAIRS,
        "        if is_anew:\n            self._forget(robot_id)",
        "        if False:\n            self._forget(robot_id)",
        "a robot's new map is merged as its old one was",
    ),
    Mutant(
        PAIRS,
        "            if reason := reason or refuted(status.alignment, outcome):",
        "            if reason:",
        "merged maps that come to contradict each other stay merged",
    ),
    Mutant(
        PAIRS,
        "        if self._stale(job):",
        "        if False:",
        "an alignment of a map that was given up is used for the new one",
    ),
    Mutant(
        PAIRS,
        "            return self._grown(pair, status.tried_area_m2, self.config.align_growth)",
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
        DOUBT,
        "    if free >= ON_FREE * len(places):",
        "    if True:",
        "liars are not doubted",
    ),
    Mutant(
        DOUBT,
        "            if self._fitting < FITTING_LEAST:\n                return False",
        "            if False:\n                return False",
        "a robot that was carried off believes itself again wherever it is",
    ),
    Mutant(
        "agent/second_look.py",
        "    if margin >= AMBIGUOUS:",
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
)
