import itertools
from dataclasses import replace

import numpy as np
import pytest

from mrslam.merge import MergeConfig
from mrslam.merge.graph.consistency import drop_broken_loops, drop_broken_triangles
from mrslam.merge.graph.edges import pair_of
from mrslam.merge.graph.nodes import Node
from mrslam.merge.graph.tree import ROOT
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
    confidence = [0.98 if pair == ("r0", "r1") else 0.7 for pair in pairs]
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


def test_a_loop_may_miss_by_more_the_longer_it_is_and_the_larger_its_maps_are():
    poses, nodes = team(12, seed=4)
    for count, size_m, closes in ((3, 10.0, False), (3, 50.0, True), (12, 10.0, True)):
        edges = edges_of(poses, [pair_of(f"r{i}", f"r{(i + 1) % count}") for i in range(count)])
        off = edges["r0", "r1"]
        edges["r0", "r1"] = replace(off, T_a_b=off.T_a_b + np.array([1.0, 0.0, 0.0]))
        sized = {x: replace(node, diameter_m=size_m) for x, node in nodes.items()}
        assert (drop_broken_loops(sized, edges, CONFIG, None)[1] == {}) == closes, (count, size_m)


def test_a_loop_is_judged_where_its_maps_content_is_not_at_their_origins():
    poses, nodes = team(3)
    edges = edges_of(poses, itertools.combinations(sorted(poses), 2))
    off = edges["r1", "r2"]
    edges["r1", "r2"] = replace(off, T_a_b=off.T_a_b + np.array([0.0, 0.0, 0.05]))  # within the tolerance of headings
    for far_m, closes in ((0.0, True), (40.0, False)):
        there = {x: replace(node, centre_m=np.array([far_m, 0.0])) for x, node in nodes.items()}
        assert (drop_broken_triangles(there, edges, CONFIG, None)[1] == {}) == closes


@pytest.mark.parametrize(("off_rad", "closes"), [(0.05, True), (0.08, False)])
def test_a_known_heading_may_be_a_little_off_however_far_its_maps_content_is_from_its_origin(off_rad, closes):
    poses, nodes = team(2)
    poses[ROOT], nodes[ROOT] = np.zeros(3), Node(area_m2=0.0, centre_m=np.zeros(2), diameter_m=0.0)
    nodes["r1"] = replace(nodes["r1"], centre_m=np.array([200.0, 0.0]))  # 0.05 rad are 10 m there
    edges = edges_of(poses, [(ROOT, "r0"), (ROOT, "r1"), ("r0", "r1")])
    known = edges[ROOT, "r1"]
    edges[ROOT, "r1"] = replace(known, T_a_b=known.T_a_b + np.array([0.0, 0.0, off_rad]))
    assert (drop_broken_triangles(nodes, edges, CONFIG, ROOT)[1] == {}) == closes
