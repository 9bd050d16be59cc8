"""Mutants of what judges chaos missions."""

from bench.mutants.mutant import Mutant

MUTANTS = (
    Mutant(
        "bench/chaos/recovery.py",
        "took_s is None or took_s > RECOVERED_S",
        "took_s is not None and took_s > RECOVERED_S",
        "a robot that never recovers passes",
    ),
    Mutant(
        "bench/chaos/recovery.py",
        "case.target is None or agent.self_doubt.doubtful",
        "case.target is None",
        "a robot that doubts to the end counts as recovered",
    ),
    Mutant(
        "bench/chaos/recovery.py",
        "return all(other.node",
        "return any(other.node",
        "one teammate that knows what a robot maps is enough",
    ),
    Mutant(
        "bench/chaos/recovery.py",
        "own > case.before or since_s > NEWS_S",
        "own > case.before",
        "a robot that stands still is said not to recover",
    ),
    Mutant(
        "bench/chaos/doubt.py",
        "before is agent and doubted",
        "doubted",
        "what a robot's other life published is said to be published in doubt",
    ),
    Mutant(
        "bench/chaos/doubt.py",
        "doubted and doubts and version != held",
        "doubted and version != held",
        "a robot that is sure again is said to publish in doubt",
    ),
    Mutant(
        "bench/chaos/doubt.py",
        "scene.now_s < fault.end_s + LOOKS_AGAIN_S",
        "scene.now_s < fault.end_s",
        "a robot that was blind just now is blamed for its wheels",
    ),
    Mutant(
        "bench/chaos/doubt.py",
        "if off_m > POSE_M >= self._off_m[robot_id]:",
        "if off_m > 10 * POSE_M >= self._off_m[robot_id]:",
        "a robot that is sure and elsewhere passes",
    ),
    Mutant(
        "bench/chaos/masking.py",
        "share > UNMASKED_MOST",
        "1.0 - share > UNMASKED_MOST",
        "teammates that are taken for walls pass",
    ),
    Mutant(
        "bench/chaos/masking.py",
        "ends = se2.apply(T_world_base, agent.scan.points_base())",
        "ends = agent.scan.points_base()",
        "beams that hit teammates are looked for in the wrong frame, and none counts",
    ),
    Mutant(
        "bench/chaos/carried_off.py",
        "noticed_s is None or noticed_s > NOTICED_S",
        "noticed_s is not None and noticed_s > NOTICED_S",
        "a robot that never notices that it was carried off passes",
    ),
    Mutant(
        "bench/chaos/carried_off.py",
        "is_known = looks >= LOOKS_ALIKE or",
        "is_known = looks < LOOKS_ALIKE or",
        "carried-off robots are judged only where nobody can notice",
    ),
    Mutant(
        "bench/chaos/carried_off.py",
        "if agent.mapper is not case.mapper or agent.self_doubt.doubtful:",
        "if agent.self_doubt.doubtful:",
        "a robot that began another map is said not to have noticed",
    ),
    Mutant(
        "bench/chaos/carried_off.py",
        "if off_m < RIGHT_M:",
        "if off_m > RIGHT_M:",
        "a robot that is elsewhere counts as right again",
    ),
    Mutant(
        "bench/chaos/repeats.py",
        "<= SIGHT_M and",
        "<= SIGHT_M or",
        "robots with walls between them count as met",
    ),
    Mutant(
        "bench/chaos/repeats.py",
        "            self._met_s.pop((one, other), None)\n",
        "            pass\n",
        "a place that was right meanwhile is said to be wrong all the time",
    ),
    Mutant(
        "bench/chaos/merging.py",
        "if not is_merged:",
        "if is_merged:",
        "robots that never merge pass",
    ),
    Mutant(
        "bench/chaos/merging.py",
        "waited_s > WAIT_S",
        "waited_s > 10 * WAIT_S",
        "robots that merge late pass",
    ),
    Mutant(
        "bench/chaos/merging.py",
        "            if self._alike >= LOOKS_ALIKE:\n                continue\n",
        "",
        "robots are blamed in houses that look alike",
    ),
    Mutant(
        "bench/chaos/merging.py",
        "if version(other)[0] == before[other]:",
        "if True:",
        "a teammate that began another map counts as unmerged",
    ),
    Mutant(
        "bench/chaos/places.py",
        "                elif not _leads_over_spoilt(scene, agent, other):",
        "                else:",
        "robots are blamed for what a torn map between them hides",
    ),
    Mutant(
        "bench/chaos/places.py",
        '                if scene.suffers(other, "liar"):',
        '                if scene.suffers(other, "liar") and not _leads_over_spoilt(scene, agent, other):',
        "a lie that came by way of a torn map may be believed",
    ),
    Mutant(
        "bench/chaos/places.py",
        "    return len(sound) < len(pairs) and not path(sound, agent.robot_id, other)",
        "    return len(sound) < len(pairs)",
        "a torn map somewhere in the team excuses every wrong place",
    ),
    Mutant(
        "bench/chaos/places.py",
        "    return len(sound) < len(pairs) and not path(sound, agent.robot_id, other)",
        "    return not path(sound, agent.robot_id, other)",
        "a place that nothing leads to is right",
    ),
    Mutant(
        "bench/chaos/masking.py",
        "    if scene.agents[mate].self_doubt.doubtful:",
        "    if False:",
        "robots are blamed for not masking who does not tell where it is",
    ),
    Mutant(
        "bench/chaos/merging.py",
        "            if before_key is not None and before_key[0] is not agent:",
        "            if False:",
        "what a robot unmerges again after it came back from an older checkpoint counts",
    ),
    Mutant(
        "bench/chaos/merging.py",
        " if pair[0] != robot_id})",
        " if False})",
        "a teammate's return lets a robot unmerge without end",
    ),
    Mutant(
        "bench/chaos/merging.py",
        """            if scene.suffers(robot_id, "liar"):
                continue
            version""",
        """            version""",
        "what a liar makes of its own lie counts",
    ),
    Mutant(
        "bench/chaos/merging.py",
        """            if scene.suffers(robot_id, "liar"):
                continue
            version""",
        """            if any(scene.suffers(one, "liar") for one in {robot_id, *agent.T_team_map}):
                continue
            version""",
        "a robot may unmerge a liar without end",
    ),
    Mutant(
        "bench/chaos/merging.py",
        "            if before_key != key:\n                continue\n",
        "",
        "a robot that began another map is said to unmerge",
    ),
    Mutant(
        "bench/chaos/places.py",
        "if share < LIE_PRECISION:",
        "if False:",
        "a liar's walls are not held against the true ones",
    ),
    Mutant(
        "bench/chaos/places.py",
        "off_m > LIE_PLACE_M",
        "off_m > 10 * LIE_PLACE_M",
        "a liar's turned map passes",
    ),
    Mutant(
        "bench/chaos/places.py",
        "off_m > FALSE_MERGE_M + strayed_m or off_deg > FALSE_MERGE_DEG",
        "off_m > FALSE_MERGE_M + strayed_m and off_deg > FALSE_MERGE_DEG",
        "false merges that are only shifted pass",
    ),
    Mutant(
        "bench/chaos/places.py",
        "if is_alike and not (at_end",
        "if not (at_end",
        "false merges pass until the end",
    ),
    Mutant(
        "bench/chaos/knowledge.py",
        "if digest.get(other, (0, 0)) < version:",
        "if digest.get(other, version) < version:",
        "maps that are forgotten pass",
    ),
    Mutant(
        "bench/chaos/knowledge.py",
        "area_m2 < SHRINKS_TO * life.largest_m2",
        "area_m2 < 0.0",
        "maps that are lost pass",
    ),
    Mutant(
        "bench/chaos/knowledge.py",
        "if known != content:",
        "if False:",
        "one version with two contents passes",
    ),
    Mutant(
        "bench/chaos/knowledge.py",
        "staged > count or pairs > count**2",
        "staged > count and pairs > count**2",
        "memory without bounds passes",
    ),
    Mutant(
        "bench/chaos/team_maps.py",
        "if precision < PRECISION:",
        "if False:",
        "team maps with wrong walls pass",
    ),
    Mutant(
        "bench/chaos/team_maps.py",
        "if kept < KEPT:",
        "if False:",
        "team maps that leave floor out pass",
    ),
    Mutant(
        "bench/chaos/team_maps.py",
        "if ghosts > GHOSTS_MOST:",
        "if False:",
        "teammates left in team maps pass",
    ),
    Mutant(
        "bench/chaos/team_maps.py",
        "return drove - stands",
        "return drove",
        "a stopped robot's body counts as its ghost where it stands",
    ),
    Mutant(
        "bench/chaos/team_maps.py",
        "if agent.node.must_stop:",
        "if True:",
        "no robot's body counts as a ghost where the robot was last",
    ),
    Mutant(
        "bench/chaos/team_maps.py",
        "if coverage < min(COVERAGE, COVERED_M2 / floor_m2) and not scene.suffers(robot_id):",
        "if False:",
        "robots that know nearly nothing in the end pass",
    ),
)
