import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.merge.graph.tree import chain, components, path, spanning_tree
from mrslam.spatial import se2
from tests.merge.graph.teams import edges_of, team


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
