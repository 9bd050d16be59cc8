"""A joint solution follows the robot's newest map by its keyframes, not by their numbers."""

from dataclasses import replace

import numpy as np

from mrslam.merge.joint.bend import Bend
from mrslam.merge.joint.bent_team import BentTeam
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.join import JointMap
from mrslam.merge.joint.ties import Tie
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import KeyScans, se2
from mrslam.spatial.matching.places import FAR_MOST_M

KEYS = np.array([[float(x), 0.0, 0.0] for x in range(6)])
STAMPS = np.arange(6) * 1_000_000_000
T_A_B = se2.transform(2.0, 1.0, 0.5)


def trail(keys: np.ndarray, stamps_ns: np.ndarray) -> Trail:
    return Trail(keys, KeyScans.of_points([np.empty((0, 2))] * len(keys), np.zeros((len(keys), 2))), stamps_ns)


def solution() -> BentTeam:
    tie = Tie("a", "b", KeyMatch(0, 0, T_A_B, np.eye(3)), believed=True)
    joint = JointMap(T_team_key={"a": KEYS, "b": se2.compose(T_A_B, KEYS)}, ties=(tie,))
    return BentTeam.of(joint, "a", dict.fromkeys("ab", trail(KEYS, STAMPS)), {})


def test_what_has_only_grown_changes_nothing() -> None:
    bent = solution()
    longer = np.vstack([KEYS, [[7.0, 3.0, 1.0]]])
    assert bent.corrected("b", trail(longer, np.append(STAMPS, 9_000_000_000))) is bent
    assert bent.corrected("c", trail(KEYS, STAMPS)) is bent


def test_keyframes_that_a_closed_loop_moved_are_those_of_the_newest_map() -> None:
    moved = KEYS + np.array([0.0, 0.2, 0.0])
    bend = solution().corrected("b", trail(moved, STAMPS)).bends["b"]
    assert np.array_equal(bend.T_map_key, moved) and len(bend.T_team_key) == 6


def test_a_robot_that_came_back_with_other_keyframes_keeps_the_place_of_those_before() -> None:
    elsewhere = np.vstack([KEYS[:4], [[3.0, -5.0, 2.0], [3.0, -6.0, 2.0]]])
    bent = solution().corrected("b", trail(elsewhere, np.append(STAMPS[:4], [20_000_000_000, 21_000_000_000])))
    assert len(bent.bends["b"].T_team_key) == 4
    assert np.allclose(bent.bends["b"].T_team_map_now, T_A_B)
    shorter = solution().corrected("b", trail(KEYS[:3], STAMPS[:3])).bends["b"]
    assert np.allclose(shorter.T_team_map_now, T_A_B) and len(shorter.T_map_key) == 3


def test_a_robot_without_any_of_its_keyframes_is_no_part_of_the_solution() -> None:
    bent = solution().corrected("b", trail(KEYS, STAMPS + 100_000_000_000))
    assert not bent.bends and not bent.joined  # what bent the others with it is gone


def test_a_match_confirms_alignments_near_where_it_has_the_maps_if_it_is_believed() -> None:
    right, wrong = (
        Tie("a", "b", KeyMatch(2, 4, se2.compose(se2.transform(x_m, 0.0, 0.0), T_A_B), np.eye(3)), believed=is_right)
        for x_m, is_right in ((3.0, True), (9.0, False))
    )
    joint = JointMap(T_team_key={"a": KEYS, "b": KEYS}, ties=(wrong, right))
    bent = BentTeam.of(joint, "a", dict.fromkeys("ab", trail(KEYS, STAMPS)), {})
    T_a_j = se2.compose(se2.transform(5.0, 0.0, 0.0), T_A_B)  # keyframe 2 of a stands at x = 2 m, 4 of b at 4 m
    there = se2.compose(T_a_j, se2.transform(-4.0, 0.0, 0.0))
    assert bent.confirms(("a", "b"), there + np.array([0.3, 0.0, 0.05]))
    for off in ([0.7, 0.0, 0.0], [0.0, 0.0, 0.2], [6.0, 0.0, 0.0]):
        assert not bent.confirms(("a", "b"), there + off)
    assert not bent.confirms(("a", "c"), there) and not bent.without("a").confirms(("a", "b"), there)


def test_it_judges_pairs_that_matches_tie_where_their_present_alignment_has_them() -> None:
    tied = solution()
    assert tied.judges("a", "b", {("a", "b"): T_A_B + 0.09})
    assert not tied.judges("a", "b", {("a", "b"): T_A_B + 0.7})
    assert not replace(tied, T_a_b={("a", "b"): T_A_B}).judges("a", "b", {})  # withdrawn


def test_it_judges_pairs_that_others_tie_where_their_present_alignment_has_them() -> None:
    by_others = replace(solution(), places={})
    assert by_others.judges("a", "b", {("a", "b"): T_A_B + 0.09})
    assert not by_others.judges("a", "b", {("a", "b"): T_A_B + 0.7})
    alone = {name: bend for name, bend in by_others.bends.items() if name == "a"}
    assert not replace(by_others, bends=alone).judges("a", "b", {("a", "b"): T_A_B})


def test_it_judges_pairs_that_were_joined_from_their_present_alignment_alone() -> None:
    begun = replace(solution(), T_a_b={("a", "b"): T_A_B}, places={}, bends={})
    assert begun.judges("a", "b", {("a", "b"): T_A_B + 0.004})  # refined
    assert not begun.judges("a", "b", {("a", "b"): T_A_B + 0.1})
    assert not begun.judges("a", "b", {("a", "b"): T_A_B + np.array([0.0, 0.0, 0.01])})  # 0.2 m off at 20 m
    assert not begun.judges("a", "b", {}) and not replace(begun, T_a_b={}).judges("a", "b", {("a", "b"): T_A_B})
    assert solution().judges("a", "b", {}) and not solution().judges("a", "c", {})


def test_a_robot_whose_map_was_removed_bends_no_other_map_any_more() -> None:
    bent = solution().without("b")
    assert not bent.bends and bent.ties == () and not bent.joined
    assert list(solution().without("c").bends) == ["a", "b"]  # not part of it


def test_a_robot_that_was_removed_is_tied_to_nobody_and_those_it_did_not_bend_stay_as_they_are() -> None:
    bent, (tie,) = solution(), solution().ties
    others = Tie("c", "d", None, believed=False)  # type: ignore[arg-type]
    places = {**bent.places, ("c", "d"): T_A_B[None]}
    both = replace(bent, ties=(tie, others), joined=frozenset("abcd"), places=places)
    left = both.without("d")
    assert left.ties == (tie,) and left.joined == frozenset("abc") and left.bends == both.bends
    assert left.confirms(("a", "b"), T_A_B) and not left.confirms(("c", "d"), T_A_B)


def test_robots_met_that_came_as_near_as_keyframes_are_compared() -> None:
    bent = solution()
    assert bent.met == {("a", "b")}
    away = Bend(KEYS, KEYS + np.array([5.0 + FAR_MOST_M - 0.1, 0.0, 0.0]))  # its first keyframe from a's last one
    far = Bend(KEYS, KEYS + np.array([5.0 + FAR_MOST_M + 0.1, 0.0, 0.0]))
    assert replace(bent, bends={"a": bent.bends["a"], "c": away, "d": far}).met == {("a", "c"), ("c", "d")}


def test_a_robot_that_is_tied_to_nobody_has_no_bend() -> None:
    joint = JointMap(T_team_key={"a": KEYS, "b": KEYS}, ties=())
    assert not BentTeam.of(joint, "a", dict.fromkeys("ab", trail(KEYS, STAMPS)), {}).bends


def test_a_solution_rests_on_the_alignments_of_bent_robots_that_ties_came_of() -> None:
    first = Tie("c", "d", None, believed=True)  # type: ignore[arg-type]
    T_a_b = dict.fromkeys([("a", "b"), ("a", "c"), ("c", "d")], T_A_B)
    bent = replace(solution(), ties=(*solution().ties, first), T_a_b=T_a_b)
    assert bent.rests_on([("a", "b")]) and not bent.rests_on([("a", "c"), ("c", "d")])
    assert replace(bent, T_a_b={}).rests_on([])
