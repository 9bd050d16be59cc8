import numpy as np
import pytest

from bench import joint as bench
from mrslam.merge import Trail
from mrslam.merge.joint.consistent import STARTS, KeyMatch, agreeing, choose
from mrslam.spatial import KeyScans


@pytest.mark.parametrize("seed", [0, 1, 2, 3])
def test_wrong_matches_are_left_out_and_right_ones_kept(seed):
    """Even seeds: at random; odd seeds: 40 % say the same wrong thing together."""
    row = bench.play(seed, robots=3, keyframes=400, share=0.4)
    assert row["wrong"] > 10
    assert row["wrong_believed"] == 0 and row["right_dropped"] <= 0.03 * row["matches"]
    assert row["moved_m"] < 0.01


def test_a_rival_is_counted():
    agrees = np.zeros((10, 10), dtype=bool)
    agrees[:6, :6] = agrees[6:, 6:] = True
    chosen = choose(agrees)
    assert chosen.keep.tolist() == [0, 1, 2, 3, 4, 5] and chosen.rival == 4


def test_outliers_that_agree_with_nobody_are_no_rival():
    agrees = np.eye(9, dtype=bool)
    agrees[:6, :6] = True
    chosen = choose(agrees)
    assert chosen.keep.tolist() == [0, 1, 2, 3, 4, 5] and chosen.rival == 1


def test_the_clique_is_a_clique():
    rng = np.random.default_rng(5)
    for _ in range(20):
        agrees = rng.random((30, 30)) < 0.7
        agrees |= agrees.T
        np.fill_diagonal(agrees, True)
        keep = choose(agrees).keep
        assert agrees[np.ix_(keep, keep)].all() and keep.size >= 6


def test_each_next_member_is_the_one_that_leaves_most_to_choose_from():
    rng = np.random.default_rng(5)
    for _ in range(20):
        agrees = rng.random((30, 30)) < 0.8
        agrees &= agrees.T
        np.fill_diagonal(agrees, True)
        best = []
        for start in np.argsort(-agrees.sum(axis=1), kind="stable")[:STARTS]:
            grown, left = [start], set(np.flatnonzero(agrees[start])) - {start}
            while left:
                grown.append(min(left, key=lambda one: (-agrees[one, list(left)].sum(), one)))
                left = {one for one in left if agrees[one, grown[-1]]} - {grown[-1]}
            best = max(best, grown, key=len)
        assert choose(agrees).keep.tolist() == sorted(best)


def test_nothing_to_choose_from():
    chosen = choose(np.zeros((0, 0), dtype=bool))
    assert chosen.keep.size == 0 and chosen.rival == 0


def test_a_loop_that_goes_far_may_miss_by_more():
    rng = np.random.default_rng(3)
    truths, trails = bench.team(rng, 2, 200)
    matches = [match for _, _, match in bench.matches_of(rng, truths)]
    first = matches[0]
    off = [match._replace(T_i_j=match.T_i_j + np.array([0.5, 0.0, 0.0])) for match in matches]
    agrees = agreeing(trails["r1"], trails["r2"], [first, *off])[0, 1:]
    way = trails["r1"].way_between(np.array([first.i]), np.array([m.i for m in off]))[0]
    way += trails["r2"].way_between(np.array([first.j]), np.array([m.j for m in off]))[0]
    assert not agrees[way < 5.0].any() and agrees[way > 60.0].all()


def test_two_matches_agree_only_if_the_loop_closes_from_either_of_them() -> None:
    way = np.zeros((31, 3))
    way[:, 0] = np.arange(31)
    trail = Trail(way, KeyScans.blank(31))
    turned = [KeyMatch(k, k, np.array([0.0, 0.0, 0.3 * (k > 0)]), np.eye(3)) for k in (0, 30)]
    # From the first on the second is where it should be, from the second on the first is 9 m off.
    assert agreeing(trail, trail, turned).tolist() == [[True, False], [False, True]]
