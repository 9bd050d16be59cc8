import itertools

import pytest

from mrslam.merge import MergeConfig
from mrslam.merge.graph.consistency import drop_broken_loops, drop_broken_triangles
from tests.merge.graph.teams import edges_of, team

CONFIG = MergeConfig()


def test_closed_triangles_keep_all_edges():
    poses, nodes = team(6)
    edges = edges_of(poses, itertools.combinations(sorted(poses), 2))
    assert drop_broken_triangles(nodes, edges, CONFIG, None) == (edges, {})
    assert drop_broken_loops(nodes, edges, CONFIG, None) == (edges, {})


@pytest.mark.parametrize("weakest", [0, 1, 2])
def test_of_an_open_triangle_the_least_sure_edge_goes(weakest):
    poses, nodes = team(3)
    pairs = [("r0", "r1"), ("r0", "r2"), ("r1", "r2")]
    confidence = [0.6 if i == weakest else 0.9 for i in range(3)]
    edges = edges_of(poses, pairs, confidence, wrong=[("r0", "r2")])
    kept, dropped = drop_broken_triangles(nodes, edges, CONFIG, None)
    assert list(dropped) == [pairs[weakest]]
    assert "r0-r1-r2" in dropped[pairs[weakest]]
    assert "m and" in dropped[pairs[weakest]]
    assert set(kept) == set(pairs) - {pairs[weakest]}


def test_a_wrong_edge_goes_although_it_is_the_surest_where_others_speak_against_it():
    poses, nodes = team(4)
    pairs = list(itertools.combinations(sorted(poses), 2))
    confidence = [0.99 if pair == ("r0", "r1") else 0.7 for pair in pairs]
    edges = edges_of(poses, pairs, confidence, wrong=[("r0", "r1")])
    kept, dropped = drop_broken_triangles(nodes, edges, CONFIG, None)
    assert list(dropped) == [("r0", "r1")]
    assert len(kept) == 5


def test_several_wrong_edges_in_a_large_team_all_go_and_no_right_one():
    poses, nodes = team(12, seed=3)
    pairs = list(itertools.combinations(sorted(poses), 2))
    wrong = [("r0", "r1"), ("r2", "r5"), ("r10", "r3"), ("r11", "r8")]
    edges = edges_of(poses, pairs, 0.8, wrong=wrong)
    _, dropped = drop_broken_triangles(nodes, edges, CONFIG, None)
    assert sorted(dropped) == sorted(wrong)


def test_loops_without_triangles_are_checked_too():
    poses, nodes = team(5, seed=1)
    pairs = [("r0", "r1"), ("r1", "r2"), ("r2", "r3"), ("r3", "r4"), ("r0", "r4")]
    edges = edges_of(poses, pairs, [0.9, 0.9, 0.55, 0.9, 0.9], wrong=[("r2", "r3")])
    assert drop_broken_triangles(nodes, edges, CONFIG, None)[1] == {}
    kept, dropped = drop_broken_loops(nodes, edges, CONFIG, None)
    assert list(dropped) == [("r2", "r3")]
    assert "5 alignments" in dropped["r2", "r3"]
    assert len(kept) == 4


def test_a_wrong_tree_edge_is_outvoted_by_longer_loops():
    poses, nodes = team(6, seed=2)
    # Two ways of three hops from r0 to r1 agree; the direct edge, the surest of all, does not.
    pairs = [("r0", "r1"), ("r0", "r2"), ("r2", "r3"), ("r1", "r3"), ("r0", "r4"), ("r4", "r5"), ("r1", "r5")]
    edges = edges_of(poses, pairs, [0.95, *[0.8] * 6], wrong=[("r0", "r1")])
    kept, dropped = drop_broken_loops(nodes, edges, CONFIG, None)
    assert list(dropped) == [("r0", "r1")]
    assert len(kept) == 6


def test_edges_of_the_known_poses_never_go():
    poses, nodes = team(3)
    edges = edges_of(poses, itertools.combinations(sorted(poses), 2), [0.1, 0.9, 0.9], wrong=[("r1", "r2")])
    _, dropped = drop_broken_triangles(nodes, edges, CONFIG, "r0")
    assert list(dropped) == [("r1", "r2")]
