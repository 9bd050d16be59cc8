import numpy as np
import pytest

from bench import joint as bench
from mrslam.merge import LocalMatcher, Trail, join
from mrslam.merge.joint.believable import MATCHES_LEAST, believable, others, solve_believable
from mrslam.merge.joint.consistent import Chosen, KeyMatch, choose
from mrslam.merge.joint.join import WIDE_LOST_M
from mrslam.merge.joint.ties import solve
from mrslam.spatial import KeyScans, se2
from tests.merge.joint.blocks import drive, errors_m

A, B = drive(0.0, 70.0, 0.001, seed=1), drive(30.0, 80.0, -0.001, seed=2)
"""Both turn by 3 degrees too much or too little within 50 m; their ways have 40 m and then 20 m in common."""
T_A_B = se2.between(A.truth[0], B.truth[0])


PAIRS = (("a", "b"), ("a", "c"), ("b", "c"))


def matches_between(joint, a, b):
    return [tie.match for tie in joint.ties if (tie.a, tie.b) == (a, b)]


def joined(matcher=None, T_a_b=T_A_B):
    return join({"a": A.trail, "b": B.trail}, {"a": se2.IDENTITY, "b": T_a_b}, matcher)


def test_bent_maps_agree_once_joined():
    rigid = errors_m(A, B, A.trail.T_map_key, se2.compose(T_A_B, B.trail.T_map_key))
    joint = joined()
    after = errors_m(A, B, joint.T_team_key["a"], joint.T_team_key["b"])
    assert rigid.mean() > 0.3
    assert after.mean() < 0.1 * rigid.mean() and after.max() < 0.15
    assert joint.tied("a", "b") >= 12 and not joint.ambiguous


def test_each_solve_brings_more_of_bent_maps_within_reach(monkeypatch):
    monkeypatch.setattr("mrslam.merge.joint.join.PASSES", 1)
    a, b = drive(0.0, 70.0, 0.003, seed=1), drive(30.0, 80.0, -0.003, seed=2)  # three times as bent
    joint = join({"a": a.trail, "b": b.trail}, {"a": se2.IDENTITY, "b": se2.between(a.truth[0], b.truth[0])})
    assert errors_m(a, b, joint.T_team_key["a"], joint.T_team_key["b"]).max() < 0.15  # 3 m after one round


def test_same_input_gives_the_same_bytes_whatever_was_asked_before():
    matcher = LocalMatcher()
    first, again, fresh = joined(matcher), joined(matcher), joined()
    before = matcher.matched
    joined(matcher)
    assert matcher.matched == before  # everything was remembered
    for name in "ab":
        assert first.T_team_key[name].tobytes() == again.T_team_key[name].tobytes() == fresh.T_team_key[name].tobytes()


@pytest.mark.parametrize("off", [(0.15, -0.1, 0.01), (0.3, 0.2, -0.02), (-0.2, 0.3, 0.03)])
def test_what_is_found_hardly_depends_on_the_first_guess(off):
    one, two = joined(), joined(T_a_b=se2.compose(T_A_B, np.array(off)))
    here, there = (joint.seen_from("a", A.trail.T_map_key)["b"] for joint in (one, two))
    assert np.hypot(*(here - there)[:, :2].T).max() < 1.5e-3  # 2 to 6 mm after one pass


@pytest.mark.parametrize("off", [(2.0, 1.0, 0.03), (-3.0, 2.0, 0.05)])
def test_maps_metres_off_are_tied_where_no_match_is_found_beside_the_first_guess(off):
    """As where a loop bent one of two large maps after they were aligned."""
    joint = joined(T_a_b=se2.compose(T_A_B, np.array(off)))
    assert errors_m(A, B, joint.T_team_key["a"], joint.T_team_key["b"]).max() < 0.05
    assert joint.tied("a", "b") == joined().tied("a", "b")


class Asked(LocalMatcher):
    """Remembers how much drift it was asked to allow for."""

    def __init__(self):
        super().__init__()
        self.lost_m = []

    def match(self, a, i, b, j, T_i_j, lost_m):
        self.lost_m.append(lost_m)
        return super().match(a, i, b, j, T_i_j, lost_m)


def test_only_where_a_robot_stays_untied_are_matches_searched_farther():
    matcher = Asked()
    c = drive(72.0, 15.0, seed=3)  # b passed there, and ties it; it ends 3 m from where a began
    trails = {"a": A.trail, "b": B.trail, "c": c.trail}
    joint = join(trails, {"a": se2.IDENTITY, "b": T_A_B, "c": se2.between(A.truth[0], c.truth[0])}, matcher)
    assert joint.tied("b", "c") and not joint.tied("a", "c")
    assert WIDE_LOST_M not in matcher.lost_m
    elsewhere = drive(75.0, 7.0, seed=3).trail  # told to be where b began, and fits nothing there
    join({**trails, "c": elsewhere}, {"a": se2.IDENTITY, "b": T_A_B, "c": T_A_B}, matcher)
    assert WIDE_LOST_M in matcher.lost_m


def test_the_order_in_which_robots_are_given_changes_nothing():
    other = join({"b": B.trail, "a": A.trail}, {"b": T_A_B, "a": se2.IDENTITY})
    assert other.T_team_key["b"].tobytes() == joined().T_team_key["b"].tobytes()


def test_the_viewers_own_way_stays_on_the_whole():
    joint = joined()
    for name, drive_ in (("a", A), ("b", B)):
        own = drive_.trail.T_map_key
        seen = joint.seen_from(name, own)
        assert se2.fit_rigid(own[:, :2], seen[name][:, :2]) == pytest.approx(np.zeros(3), abs=1e-9)
    by_a, by_b = (joint.seen_from(name, drive_.trail.T_map_key) for name, drive_ in (("a", A), ("b", B)))
    assert se2.between(by_a["a"][5], by_a["b"][7]) == pytest.approx(se2.between(by_b["a"][5], by_b["b"][7]), abs=1e-9)


def test_own_ways_are_not_touched():
    before = A.trail.T_map_key.tobytes()
    joined()
    assert A.trail.T_map_key.tobytes() == before


def test_a_place_that_is_not_there_ties_nobody():
    elsewhere = se2.compose(se2.transform(300.0, 0.0, 0.0), T_A_B)
    joint = joined(T_a_b=elsewhere)
    assert not joint.ties
    assert joint.T_team_key["b"] == pytest.approx(se2.compose(elsewhere, B.trail.T_map_key))


def test_robots_without_scans_or_place_are_left_out():
    blind = Trail(np.zeros((0, 3)), KeyScans.empty())
    joint = join({"a": A.trail, "b": B.trail, "c": blind, "d": A.trail}, {"a": se2.IDENTITY, "b": T_A_B, "c": T_A_B})
    assert sorted(joint.T_team_key) == ["a", "b"]


def test_fewer_matches_than_needed_tie_nobody():
    short = Trail(B.trail.T_map_key[:8], B.trail.scans.part(0, 8))  # 4 m of way: two places at most
    joint = join({"a": A.trail, "b": short}, {"a": se2.IDENTITY, "b": T_A_B})
    assert joint.tied("a", "b") < MATCHES_LEAST and not joint.ties


def test_a_wrong_match_that_slipped_in_is_dropped_in_the_solve():
    good = [(tie.a, tie.b, tie.match) for tie in joined().ties]
    wrong = KeyMatch(5, 60, se2.transform(4.0, -3.0, 1.0), good[0][2].information)
    trails, poses = {"a": A.trail, "b": B.trail}, dict(joined().T_team_key)
    clean, _ = solve(trails, poses, good)
    spoilt, ties = solve(trails, poses, [*good, ("a", "b", wrong)])
    assert [tie.believed for tie in ties] == [True] * len(good) + [False]
    assert np.abs(spoilt["b"] - clean["b"]).max() < 0.01


def test_a_spare_match_is_believed_where_it_agrees_and_is_no_tie_where_it_does_not():
    good = [(tie.a, tie.b, tie.match) for tie in joined().ties]
    wrong = ("a", "b", KeyMatch(5, 60, se2.transform(4.0, -3.0, 1.0), good[0][2].information))
    trails, poses = {"a": A.trail, "b": B.trail}, dict(joined().T_team_key)
    whole, all_ties = solve(trails, poses, good)
    again, ties = solve(trails, poses, good[1:], [wrong, good[0]])
    assert len(ties) == len(all_ties) and {tie.match.i for tie in ties} == {match.i for *_, match in good}
    assert all(tie.believed for tie in ties) and np.abs(again["b"] - whole["b"]).max() < 1e-3
    found = {("a", "b"): {(m.i, m.j): m for *_, m in good}}
    assert [one[2].i for one in others(found, good[1:], {})] == [good[0][2].i]


def test_matches_too_few_to_tie_two_robots_are_held_against_what_third_ones_say():
    """Of a short drive c along a's way only two matches are left beside those with b, which bridges the two."""
    c = drive(45.0, 60.0, 0.0, seed=3)
    trails = {"a": A.trail, "b": B.trail, "c": c.trail}
    T_team_map = {"a": se2.IDENTITY, "b": T_A_B, "c": se2.between(A.truth[0], c.truth[0])}
    joint = join(trails, T_team_map)
    found = {pair: {(m.i, m.j): m for m in matches_between(joint, *pair)} for pair in PAIRS}
    few = dict(list(found["a", "c"].items())[: MATCHES_LEAST - 1])
    chosen, ambiguous = believable(trails, {**found, ("a", "c"): few}, {})
    assert {(a, b) for a, b, _ in chosen} == {("a", "b"), ("b", "c")} and not ambiguous
    spare = others({**found, ("a", "c"): few}, chosen, ambiguous)
    assert [(match.i, match.j) for a, b, match in spare if (a, b) == ("a", "c")] == list(few)
    # Nothing else ties c, or it is not to be decided: then they say nothing.
    assert not others({("a", "b"): found["a", "b"], ("a", "c"): few}, [one for one in chosen if "c" not in one[:2]], {})
    assert not [one for one in others({**found, ("a", "c"): few}, chosen, {("a", "c"): "two answers"}) if one[1] == "c"]
    poses = {name: se2.compose(T_team_map[name], trails[name].T_map_key) for name in trails}
    _, ties = solve(trails, poses, chosen, spare)
    assert sum((tie.a, tie.b) == ("a", "c") and tie.believed for tie in ties) == len(few)
    wrong = [(a, b, m._replace(T_i_j=se2.compose(m.T_i_j, (5.0 * k, 7.0, 1.0 + k))))
             for k, (a, b, m) in enumerate(chosen) if "c" in (a, b)]  # fmt: skip
    for of_c in (wrong, []):
        _, ties = solve(trails, poses, [one for one in chosen if "c" not in one[:2]] + of_c, spare)
        assert not any("c" in (tie.a, tie.b) and tie.believed for tie in ties)  # nothing to hold spare ones against


def test_right_matches_that_were_kept_out_of_the_largest_set_are_believed_in_the_end(monkeypatch):
    whole = joined()
    monkeypatch.setattr(
        "mrslam.merge.joint.believable.choose", lambda agrees: Chosen(choose(agrees).keep[:-3], choose(agrees).rival)
    )
    assert joined().tied("a", "b") == whole.tied("a", "b")


@pytest.mark.parametrize("seed", [36, 68, 88])
def test_a_wrong_match_that_agreed_by_chance_takes_no_right_ones_with_it(seed):
    row = bench.play(seed, robots=4, keyframes=500, share=0.4)
    assert row["wrong_believed"] == 0 and row["moved_m"] < 0.01  # 0.02 to 0.13 m without looking at others again


@pytest.mark.parametrize(("share", "tied"), [(0.2, True), (0.48, False)])
def test_where_two_answers_are_as_good_as_each_other_neither_is_believed(share, tied):
    rng = np.random.default_rng(7)
    truths, trails = bench.team(rng, 2, 400)
    matches, _ = bench.spoilt(rng, trails, bench.matches_of(rng, truths), share, together=True)
    found = {("r1", "r2"): {(match.i, match.j): match for _, _, match in matches}}
    chosen, ambiguous = believable(trails, found, {})
    assert bool(chosen) == tied and (("r1", "r2") in ambiguous) != tied


def outvoted(seen, few=5, off_m=3.0):
    """Solve a, b and c: the few matches of a and b are right, those of either with c put the two this far apart."""
    c = drive(45.0, 60.0, 0.0, seed=3)
    trails = {"a": A.trail, "b": B.trail, "c": c.trail}
    T_team_map = {"a": se2.IDENTITY, "b": T_A_B, "c": se2.between(A.truth[0], c.truth[0])}
    joint = join(trails, T_team_map)
    found = {pair: {(m.i, m.j): m for m in matches_between(joint, *pair)} for pair in PAIRS}
    found["a", "b"] = dict(list(found["a", "b"].items())[:few])
    shift = np.array([off_m, 0.0, 0.0])  # of c in the map of a: all of the pair's matches say the same
    for key, m in found["a", "c"].items():
        T_map_i = A.trail.T_map_key[m.i]
        wrong = se2.between(T_map_i, se2.compose(shift, se2.compose(T_map_i, m.T_i_j)))
        found["a", "c"][key] = m._replace(T_i_j=wrong)
    poses = {name: se2.compose(T_team_map[name], trails[name].T_map_key) for name in trails}
    solved, ties, unused = solve_believable(trails, poses, found, seen)
    believed = {pair: sum((tie.a, tie.b) == pair and tie.believed for tie in ties) for pair in PAIRS}
    return errors_m(A, B, solved["a"], solved["b"]).mean(), believed, unused, {pair: len(found[pair]) for pair in PAIRS}


def test_what_robots_saw_of_each_other_is_not_outvoted_by_third_ones():
    off_m, believed, unused, counts = outvoted({})
    assert off_m > 1.0 and not believed["a", "b"] and not unused  # so it is without
    assert counts["a", "b"] < min(counts["a", "c"], counts["b", "c"])
    off_m, believed, unused, counts = outvoted({("a", "b"): T_A_B})
    smaller = min(PAIRS[1:], key=lambda pair: counts[pair])
    assert off_m < 0.5 and believed["a", "b"] >= counts["a", "b"] - 1 and list(unused) == [smaller]
    assert believed[next(pair for pair in PAIRS[1:] if pair != smaller)] > 0


def test_what_robots_saw_of_each_other_is_not_outvoted_where_nothing_else_ties_the_two():
    off_m, believed, unused, _ = outvoted({}, few=2)
    assert off_m > 2.0 and not unused  # so it is without
    off_m, believed, unused, _ = outvoted({("a", "b"): T_A_B}, few=2)
    assert off_m < 1.0 and len(unused) == 1 and sum(believed.values()) > 0
    a_little_beside = se2.compose(np.array([1.5, 0.0, 0.0]), T_A_B)  # bent maps are corrected by that much
    assert not outvoted({("a", "b"): a_little_beside}, few=2, off_m=0.0)[2]


def test_matches_that_are_not_where_robots_saw_each_other_tie_nobody():
    elsewhere = se2.compose(np.array([3.0, 0.0, 0.0]), T_A_B)
    _, believed, unused, _ = outvoted({("a", "b"): elsewhere})
    assert "saw each other" in unused["a", "b"] and believed["a", "c"] and believed["b", "c"]


def test_where_all_pairs_saw_each_other_none_is_left_out():
    c = drive(45.0, 60.0, 0.0, seed=3)
    T_a_c, T_b_c = se2.between(A.truth[0], c.truth[0]), se2.between(B.truth[0], c.truth[0])
    shifted = se2.compose(np.array([3.0, 0.0, 0.0]), T_a_c)
    assert not outvoted({("a", "b"): T_A_B, ("a", "c"): shifted, ("b", "c"): T_b_c})[2]
