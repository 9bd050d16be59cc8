import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.merge import MergeConfig
from mrslam.merge.graph.consistency import drop_broken_loops, drop_broken_triangles
from mrslam.merge.graph.edges import make_edge
from mrslam.merge.graph.nodes import Node
from mrslam.merge.graph.tree import chain, components, path, spanning_tree
from mrslam.spatial import se2
from tests.merge.plans import alignment

CONFIG = MergeConfig()


def team(count: int, seed: int = 0):
    """Return poses and nodes of so many robots."""
    rng = np.random.default_rng(seed)
    ids = [f"r{i}" for i in range(count)]
    poses = {x: se2.transform(*rng.uniform(-20, 20, 2), rng.uniform(-3, 3)) for x in ids}
    return poses, {x: Node(area_m2=50.0, centre_m=np.zeros(2), diameter_m=10.0) for x in ids}


def edges_of(poses, pairs, confidence=0.9, wrong=()):
    """Return true edges, those in ``wrong`` off by three metres."""
    out = {}
    for i, (a, b) in enumerate(pairs):
        T_a_b = se2.between(poses[a], poses[b]) + (np.array([3.0, 0.0, 0.0]) if (a, b) in wrong else 0.0)
        value = confidence if isinstance(confidence, float) else confidence[i]
        out[a, b] = make_edge(a, b, alignment(T_a_b, value))
    return out


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


@given(st.integers(0, 1000))
@settings(max_examples=40)
def test_the_spanning_tree_is_the_heaviest_there_is(seed):
    rng = np.random.default_rng(seed)
    poses, _ = team(5)
    pairs = [p for p in itertools.combinations(sorted(poses), 2) if rng.random() < 0.7]
    edges = edges_of(poses, pairs, [float(v) for v in rng.uniform(0.5, 1.0, len(pairs))])
    tree = spanning_tree(edges, lambda edge: edge.confidence)
    groups = components(poses, edges)
    assert components(poses, tree) == groups
    assert len(tree) == len(poses) - len(groups)
    best = max(
        sum(edges[p].confidence for p in some)
        for some in itertools.combinations(pairs, len(tree))
        if components(poses, {p: edges[p] for p in some}) == groups
    )
    assert sum(edge.confidence for edge in tree.values()) == pytest.approx(best)


def test_paths_and_chains_follow_the_tree():
    poses, _ = team(5)
    tree = edges_of(poses, [("r0", "r3"), ("r1", "r3"), ("r1", "r4")])
    assert path(tree, "r0", "r4") == [("r0", "r3"), ("r1", "r3"), ("r1", "r4")]
    assert path(tree, "r0", "r2") == []
    assert path(tree, "r0", "r0") == []
    found = chain(tree, "r4")
    assert sorted(found) == ["r0", "r1", "r3", "r4"]
    for robot_id, T_r4_map in found.items():
        np.testing.assert_allclose(T_r4_map, se2.between(poses["r4"], poses[robot_id]), atol=1e-9)


def test_a_chain_of_transforms_does_not_depend_on_how_it_is_bracketed():
    poses, _ = team(4, seed=9)
    T_ab, T_bc, T_cd = (se2.between(poses[f"r{i}"], poses[f"r{i + 1}"]) for i in range(3))
    left = se2.compose(se2.compose(T_ab, T_bc), T_cd)
    np.testing.assert_allclose(left, se2.compose(T_ab, se2.compose(T_bc, T_cd)), atol=1e-9)
    np.testing.assert_allclose(left, se2.between(poses["r0"], poses["r3"]), atol=1e-9)
