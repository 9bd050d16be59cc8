import itertools
from dataclasses import replace

import numpy as np
import pytest

from mrslam.merge import MergeConfig
from mrslam.merge.graph.consistency import chain, spanning_tree
from mrslam.merge.graph.edges import make_edge
from mrslam.merge.graph.solve import _residual, jointly
from mrslam.spatial import se2
from tests.merge.plans import alignment


def noisy_team(count: int, seed: int, sigma_m: float, sigma_rad: float):
    rng = np.random.default_rng(seed)
    ids = [f"r{i}" for i in range(count)]
    poses = {x: se2.transform(*rng.uniform(-10, 10, 2), rng.uniform(-3, 3)) for x in ids}
    poses["r0"] = np.zeros(3)
    edges = {}
    for a, b in itertools.combinations(ids, 2):
        noise = rng.normal(size=3) * [sigma_m, sigma_m, sigma_rad]
        edges[a, b] = make_edge(a, b, alignment(se2.between(poses[a], poses[b]) + noise, 0.9, 0.05, 0.005))
    return poses, edges


def first_guess(edges):
    return chain(spanning_tree(edges, lambda edge: edge.confidence), "r0")


def error(found, poses):
    return np.sqrt(np.mean([se2.difference(found[x], poses[x])[0] ** 2 for x in poses]))


def test_without_noise_the_truth_comes_out_and_the_anchor_stays():
    poses, edges = noisy_team(5, 0, 0.0, 0.0)
    guess = {x: T if x == "r0" else np.add(T, [0.3, -0.2, 0.05]) for x, T in first_guess(edges).items()}
    found = jointly(guess, edges.values(), "r0", MergeConfig())
    assert (found["r0"] == 0.0).all()
    for x, T in poses.items():
        np.testing.assert_allclose(found[x], T, atol=1e-6)


def test_all_edges_together_beat_the_spanning_tree():
    gains = []
    for seed in range(20):
        poses, edges = noisy_team(8, seed, 0.05, 0.005)
        guess = first_guess(edges)
        gains.append(error(guess, poses) / error(jointly(guess, edges.values(), "r0", MergeConfig()), poses))
    assert np.median(gains) > 1.3


def test_one_outlier_is_resisted():
    poses, edges = noisy_team(6, 4, 0.01, 0.001)
    wrong = np.add(edges["r1", "r2"].T_a_b, [2.0, 1.0, 0.3])
    edges["r1", "r2"] = make_edge("r1", "r2", alignment(wrong, 0.5, 0.05, 0.005))
    found = jointly(first_guess(edges), edges.values(), "r0", MergeConfig())
    assert error(found, poses) < 0.05


def test_an_alignment_that_claims_to_be_exact_is_taken_for_one_of_a_centimetre():
    poses, edges = noisy_team(3, 5, 0.02, 0.002)
    pair = next(iter(edges))
    edges[pair] = replace(edges[pair], covariance=np.zeros((3, 3)))
    found = jointly(first_guess(edges), edges.values(), "r0", MergeConfig())
    assert error(found, poses) < 0.1
    off_m, _ = se2.difference(se2.between(found[pair[0]], found[pair[1]]), edges[pair].T_a_b)
    assert 0.0 < off_m < 0.01


@pytest.mark.parametrize(("scale", "is_shared"), [(1.0, False), (100.0, True)])
def test_where_covariances_are_believed_less_the_gap_of_a_loop_is_shared_and_not_one_alignments_fault(scale, is_shared):
    _, edges = noisy_team(3, 6, 0.0, 0.0)
    wrong = edges["r0", "r2"]
    edges["r0", "r2"] = replace(wrong, T_a_b=wrong.T_a_b + np.array([1.0, 0.0, 0.0]))
    found = jointly(first_guess(edges), edges.values(), "r0", MergeConfig(covariance_scale=scale))
    off_m = [se2.difference(se2.between(found[edge.a], found[edge.b]), edge.T_a_b)[0] for edge in edges.values()]
    assert max(off_m) < 0.6 if is_shared else max(off_m) > 0.9


def test_the_order_of_edges_does_not_change_a_bit():
    _, edges = noisy_team(6, 5, 0.05, 0.005)
    guess = first_guess(edges)
    one = jointly(guess, edges.values(), "r0", MergeConfig())
    two = jointly(dict(reversed(guess.items())), list(edges.values())[::-1], "r0", MergeConfig())
    for x in one:
        assert one[x].tobytes() == two[x].tobytes()


@pytest.mark.parametrize("which", [0, 1])
def test_derivatives_are_those_of_the_residual(which):
    rng = np.random.default_rng(6)
    for _ in range(20):
        T = [se2.transform(*rng.uniform(-5, 5, 2), rng.uniform(-3, 3)) for _ in range(3)]
        analytic = _residual(T[0][None], T[1][None], T[2][None])[1 + which][0]
        for k in range(3):
            step = np.zeros(3)
            step[k] = 1e-6
            ends = []
            for sign in (1, -1):
                moved = [T[0], T[1]]
                moved[which] = moved[which] + sign * step
                ends.append(_residual(*(pose[None] for pose in moved), T[2][None])[0][0])
            np.testing.assert_allclose((ends[0] - ends[1]) / 2e-6, analytic[:, k], atol=1e-5)


def test_the_gap_of_a_loop_is_shared_where_headings_lie_on_both_sides_of_half_a_turn():
    poses = {"r0": np.zeros(3), "r1": se2.transform(3.0, 1.0, np.pi - 0.003), "r2": se2.transform(-2.0, 4.0, 0.4)}
    beyond = {**poses, "r1": se2.transform(3.0, 1.0, np.pi + 0.017)}
    edges = [
        make_edge(a, b, alignment(se2.between(told[a], told[b]), sigma_m=1.0, sigma_rad=0.01))
        for a, b, told in (("r0", "r1", poses), ("r0", "r2", poses), ("r1", "r2", beyond))
    ]
    found = jointly(poses, edges, "r0", MergeConfig())
    assert se2.wrap(found["r1"][2] - poses["r1"][2]) == pytest.approx(0.02 / 3.0, rel=0.1)
