"""Mutants of how an agent doubts itself and what it reports of others."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "agent/witness.py",
        "return effects or self._look_through(team, now_ns)",
        "return effects",
        "a place through third robots where nobody is stays",
    ),
    Mutant(
        "agent/witness.py",
        "            if is_own:\n                belief.places",
        "            if False:\n                belief.places",
        "robots do not look where third robots place a teammate",
    ),
    Mutant(
        "agent/self_doubt.py",
        "            if not torn and health >= self.min_health:",
        "            if True:",
        "robots never doubt themselves",
    ),
    Mutant(
        "agent/self_doubt.py",
        "        if self._doubted_ns >= self.give_up_ns:",
        "        if False:",
        "a robot that is lost never begins a new map",
    ),
    Mutant(
        "agent/self_doubt.py",
        "            if self._fitting < FITTING_LEAST:\n                return False",
        "            if False:\n                return False",
        "a robot that was carried off believes itself again wherever it is",
    ),
    Mutant(
        "agent/blindness.py",
        "        if self._blind or now_ns - self._seen_ns < BLIND_NS:",
        "        if True:",
        "nobody hears of a laser that is of no use",
    ),
    Mutant(
        "agent/witness.py",
        "if (reason := against(belief.places, T_a_b)) is not None:",
        "if False:",
        "a pair whose robots looked in vain for each other stays merged",
    ),
    Mutant(
        "agent/witness.py",
        "if is_due and heard_epoch == epoch:",
        "if is_due:",
        "what was seen of a teammate's old map is told of its new one",
    ),
    Mutant(
        "agent/witness.py",
        "if may_repeat and waited_ns >= REPEAT_NS:",
        "if waited_ns >= REPEAT_NS:",
        "what was seen of robots that are gone is told for ever",
    ),
    Mutant(
        "agent/core.py",
        "                    self._witness.meet()\n",
        "",
        "who comes into reach never hears that a robot is not where it is placed",
    ),
    Mutant(
        "agent/witness.py",
        "        self._told = told  # of places that are gone nothing is kept\n",
        "        self._told |= told\n",
        "what was told of places is kept for ever",
    ),
    Mutant(
        "agent/witness.py",
        "if moment is None or known is None or known.epoch != report.epoch:",
        "if moment is None or known is None:",
        "a teammate that began a new map is looked for by the place of the old one",
    ),
    Mutant(
        "agent/witness.py",
        "        if self.robot_id != pair[0]:\n",
        "        if False:\n",
        "the second of two robots that see each other merges inside out",
    ),
    Mutant(
        "agent/own_sightings.py",
        "        return seen_from(pair, self.robot_id, place.T_a_b)\n",
        "        return place.T_a_b\n",
        "the second of two robots looks for the other in the wrong place",
    ),
    Mutant(
        "agent/witness.py",
        "new.append((peer, seen_from(pair, self.robot_id, place.T_a_b), place",
        "new.append((peer, place.T_a_b, place",
        "the second of two robots tells what it saw of another place",
    ),
    Mutant(
        "agent/self_doubt.py",
        "se2.compose(T_map_base, scan.T_base_laser), ends",
        "T_map_base, ends",
        "a robot whose laser is not in its middle never believes again where it is, once it was resumed elsewhere",
    ),
    Mutant(
        "agent/self_doubt.py",
        "(is_back and match_score",
        "(match_score",
        "robots doubt themselves among hedges and at doors, and give good maps up",
    ),
    Mutant(
        "agent/self_doubt.py",
        "torn = is_lost or (is_back and match_score < TORN * usual and not fits())",
        "torn = is_lost",
        "a robot that was carried while it was off goes on where its wheels have it",
    ),
    Mutant(
        "agent/self_doubt.py",
        "            self._usual = usual + USUAL_MEMORY * (match_score - usual)\n",
        "            self._usual = 1.0\n",
        "a robot that wakes up in a hall of which it never sees much doubts itself",
    ),
    Mutant(
        "agent/self_doubt.py",
        "            self.doubtful = self._is_for_now = False\n",
        "            self._is_for_now = False\n",
        "a resumed robot forgets that it may be elsewhere once its scans fit each other",
    ),
    Mutant(
        "agent/self_doubt.py",
        "        self.doubtful = self._is_for_now = True\n",
        "        self.doubtful = True\n",
        "a scan with old odometry makes a robot doubt for longer than that scan",
    ),
    Mutant(
        "agent/self_doubt.py",
        ', "_is_for_now")',
        ")",
        "a robot saved while it doubts for a scan does not look whether its map shows the next",
    ),
    Mutant(
        "agent/witness.py",
        "T_a_b = team.layout.T_between(*pair) if belief.alignment is None else belief.alignment.T_a_b",
        "T_a_b = None if belief.alignment is None else belief.alignment.T_a_b",
        "robots that others lead to each other send for ever what they see of each other",
    ),
    Mutant(
        "agent/witness.py",
        "min(max(claim.llr, MOST_UNSEEN_LLR), MOST_SEEN_LLR)",
        "max(claim.llr, MOST_UNSEEN_LLR)",
        "one robot's claim lays maps anywhere, against all that another one saw",
    ),
    Mutant(
        "agent/self_doubt.py",
        "waited_ns if self.torn else waited_ns // PATIENCE",
        "waited_ns",
        "robots outdoors give good maps up",
    ),
    Mutant(
        "agent/self_doubt.py",
        "torn = is_lost or (is_back",
        "torn = (is_back",
        "a robot that was carried to a place that looks alike goes on as if it were found",
    ),
    Mutant(
        "agent/self_doubt.py",
        "        self.torn |= is_lost\n",
        "",
        "a robot that is carried while it doubts goes on as if it were found",
    ),
    Mutant(
        "agent/self_doubt.py",
        "else max(now_ns - self._looked_ns, 0)",
        "else now_ns - self._looked_ns",
        "a robot whose clock was set back doubts for as long as it went back",
    ),
)
