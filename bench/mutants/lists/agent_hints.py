"""Mutants of what robots tell each other of pairs they aligned, and what a hearer does with it."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "agent/pairs/hints.py",
        "name in searching and name not in self._failed for",
        "name in searching for",
        "a robot relies on the searches of a teammate whose hints are wrong",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "            self._failed[job.hinted_by] = self._failed.get(job.hinted_by, 0) + 1\n",
        "            pass\n",
        "a liar's hints are tried without end",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "                self._failed.pop(peer, None)\n",
        "                pass\n",
        "one who was right is not heard again",
    ),
    Mutant(
        "agent/pairs/hints.py",
        " or hint.epoch != maps[peer].epoch",
        "",
        "a hint about a map that was given up is tried",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "yield (b, found.T_a_b) if a == self.own_id else (a, se2.inverse(found.T_a_b))",
        "yield (b, found.T_a_b) if a == self.own_id else (a, found.T_a_b)",
        "the second of a pair tells hints inside out",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "name in searching and name not",
        "name not",
        "a robot waits for the searches of a teammate that is gone",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "            for robot, hint in hints.items():\n                if robot not in maps",
        "            for robot, hint in hints.items():\n                if robot not in maps or robot == self.own_id",
        "hints about the own map are not tried",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "found is not None or (peer in tied and robot in tied)",
        "found is not None",
        "hints about pairs that loops hold are tried without need",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "    return grown and now_ns - hint.tried_ns >= config.align_interval_s * 1e9",
        "    return False",
        "a hint that failed is never tried again though maps grow",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "found = belief.alignment if is_saved(robot) else belief.found",
        "found = belief.found",
        "a robot that only localises is not placed by who looked for it before it told where it is",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "found = belief.alignment if any(map(is_saved, (a, b))) else belief.found",
        "found = belief.found",
        "teammates believe a place in a saved map that the robot itself does not",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "(dict(self._found(beliefs)) | dict(tracked)).items()",
        "self._found(beliefs)",
        "a robot that tracks where others' maps placed it does not tell where it is",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "            told.times = 0\n",
        "            pass\n",
        "who comes later is not told",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "place = seen_from(pair, peer, hint.T_peer_robot)",
        "place = hint.T_peer_robot",
        "hints of the second of a pair are looked for inside out",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "        if robot_id == self.own_id:\n            self._told.clear()",
        "        pass",
        "after a new map the places found in it are not told",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "            hints.pop(robot_id, None)\n        self._left",
        "            pass\n        self._left",
        "hints about a map that was given up are tried on the new one",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "self.epoch == hint.epoch and SAME_PLACE",
        "SAME_PLACE",
        "a hint about a new map at the place of the old one is not heard",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "last_ns is not None and now_ns - last_ns < PATIENCE_S * 1e9 and",
        "last_ns is not None and",
        "pairs that a teammate searches for are never searched for again here",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "tellers = pair[:1] if is_own else pair",
        "tellers = pair[:1] if is_own else ()",
        "of sixteen robots in sight of each other every one searches for the pairs of all others",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "tellers = pair[:1] if is_own else pair",
        "tellers = pair",
        "of two robots in sight of each other neither searches for their pair",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "            last_ns = self._left.setdefault(pair, now_ns)\n",
        "            pass\n",
        "pairs of two others are searched for once by everybody before they are left to them",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "        self._left = {pair: since_ns for pair, since_ns in self._left.items() if robot_id not in pair}\n",
        "",
        "a new map of a teammate is searched for by everybody at once",
    ),
    Mutant(
        "agent/pairs/hints.py",
        " < PATIENCE_S * 1e9 and belief.found is None",
        " < PATIENCE_S * 1e9",
        "what a hint has found of two others in sight is confirmed a minute and a half later",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "        if last_ns is None and not is_own:\n",
        "        if last_ns is None:\n",
        "the first search for a pair waits for the teammate's",
    ),
    Mutant(
        "agent/pairs/hints.py",
        "(a.trail, b.trail),",
        "(b.trail, a.trail),",
        "where a teammate found maps they are bent by each other's keyframes",
    ),
)
