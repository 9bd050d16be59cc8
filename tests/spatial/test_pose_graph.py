import numpy as np
import pytest

from mrslam.spatial import se2
from mrslam.spatial.pose_graph import Edges, _truncated, marginal, relax, relax_again, relax_graduated, shortest

TIGHT = np.diag([1e4, 1e4, 1e4])


def ring(count: int = 20) -> np.ndarray:
    angle = np.arange(count) * 2.0 * np.pi / count
    return np.stack([5.0 * np.cos(angle), 5.0 * np.sin(angle), se2.wrap(angle + np.pi / 2)], axis=1)


def edges_of(poses: np.ndarray, pairs: list[tuple[int, int]], information: np.ndarray = TIGHT) -> Edges:
    first, second = np.array(pairs, dtype=np.int64).T
    return Edges(first, second, se2.between(poses[first], poses[second]), np.tile(information, (len(pairs), 1, 1)))


def chain(count: int) -> list[tuple[int, int]]:
    return [(k, k + 1) for k in range(count - 1)]


def start(poses: np.ndarray) -> np.ndarray:
    rng = np.random.default_rng(1)
    noisy = poses + rng.normal(0.0, (0.3, 0.3, 0.1), poses.shape)
    noisy[0] = poses[0]
    return noisy


def test_exact_edges_are_met():
    truth = ring()
    edges = edges_of(truth, [*chain(20), (19, 0), (0, 10)])
    solved = relax(start(truth), edges, np.zeros(21, dtype=bool))
    assert np.abs(solved - truth).max() < 1e-3
    assert edges.chi2(solved).max() < 0.1


def test_two_edges_that_differ_meet_where_their_information_says():
    edges = Edges(
        np.array([0, 0]), np.array([1, 1]), np.array([[1.0, 0.0, 0.0], [2.0, 0.0, 0.0]]),
        np.stack([np.diag([300.0, 300.0, 1.0]), np.diag([100.0, 100.0, 1.0])]),
    )  # fmt: skip
    solved = relax(np.zeros((2, 3)), edges, np.zeros(2, dtype=bool))
    assert solved[1] == pytest.approx([1.25, 0.0, 0.0], abs=1e-4)


def test_a_wrong_doubtful_edge_counts_nothing():
    truth = ring()
    good = edges_of(truth, [*chain(20), (19, 0), (2, 12), (5, 15)])
    wrong = Edges(np.array([0]), np.array([7]), np.array([[3.0, 3.0, 1.0]]), TIGHT[None])
    edges = Edges.joined([good, wrong])
    doubtful = np.arange(edges.first.size) >= 20
    solved, weight = relax_graduated(start(truth), edges, doubtful, 16.27)
    assert np.abs(solved - truth).max() < 1e-3
    assert weight.tolist() == [1.0] * 22 + [0.0]


def test_without_graduation_the_same_edge_would_bend_everything():
    truth = ring()
    edges = Edges.joined(
        [edges_of(truth, chain(20)), Edges(np.array([0]), np.array([7]), np.array([[3.0, 3.0, 1.0]]), TIGHT[None])]
    )
    assert np.abs(relax(truth, edges, np.zeros(20, dtype=bool)) - truth).max() > 0.3


def test_weights_of_the_surrogate_are_those_that_make_it_least() -> None:
    weight, bound = np.linspace(0.0, 1.0, 2001)[:, None], 16.0
    chi2 = np.array([0.1, 3.0, 7.9, 8.1, 12.0, 15.9, 16.1, 20.0, 31.9, 32.1, 300.0])
    for mu in (1e-3, 0.1, 1.0, 30.0):
        surrogate = weight * chi2 + mu * (1.0 - weight) / (mu + weight) * bound  # Yang et al. 2020, equation 12
        assert _truncated(chi2, bound, mu) == pytest.approx(weight[surrogate.argmin(axis=0), 0], abs=1e-3)


def test_among_loops_of_which_many_are_wrong_few_wrong_ones_are_believed() -> None:
    """Four of ten loops over a way that drifted are wrong: a loss that is sharp at once believes more of them."""
    believed = np.zeros(2)
    for seed in range(20):
        rng, truth = np.random.default_rng(seed), ring(40)
        way = edges_of(truth, chain(40), np.diag([100.0, 100.0, 400.0]))
        way.T_first_second[:] += rng.normal(0.0, (0.07, 0.07, 0.035), way.T_first_second.shape)
        begin = truth.copy()
        for k in range(39):
            begin[k + 1] = se2.compose(begin[k], way.T_first_second[k])
        good = edges_of(truth, [(39, 0), (2, 21), (5, 25), (9, 30), (13, 33), (17, 38)])
        first = rng.integers(0, 18, 4)
        wrong = edges_of(truth, list(zip(first, first + rng.integers(10, 20, 4), strict=True)))
        wrong.T_first_second[:] += rng.uniform(-1.0, 1.0, (4, 3)) * (4.0, 4.0, 1.5)
        edges = Edges.joined([way, good, wrong])
        _, weight = relax_graduated(begin, edges, np.arange(49) >= 39, 16.27)
        believed += weight[39:45].sum(), weight[45:].sum()
    assert believed[0] > 0.5 * 120 and believed[1] < 0.1 * 80


def test_edges_that_always_count_are_never_dropped():
    truth = ring(5)
    edges = Edges.joined(
        [edges_of(truth, chain(5)), Edges(np.array([0]), np.array([4]), np.array([[9.0, 9.0, 1.0]]), TIGHT[None])]
    )
    _, weight = relax_graduated(truth, edges, np.zeros(5, dtype=bool), 16.27)
    assert weight.tolist() == [1.0] * 5


def test_a_surer_edge_that_is_doubtful_does_not_drive_out_one_that_always_counts() -> None:
    edges = Edges(
        np.array([0, 0]), np.array([1, 1]), np.array([[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]), np.stack([TIGHT, 4.0 * TIGHT])
    )
    solved, weight = relax_graduated(np.zeros((2, 3)), edges, np.array([False, True]), 16.27)
    assert weight.tolist() == [1.0, 0.0]
    assert solved[1] == pytest.approx([1.0, 0.0, 0.0], abs=1e-3)


def test_the_shortest_way_leads_over_edges_either_way() -> None:
    ends = np.array([[1, 0], [1, 2], [3, 2], [0, 3]])
    found = shortest(np.array([1.0, 2.0, 4.0, 9.0]), ends, 5, 0)
    assert found.tolist() == [0.0, 1.0, 3.0, 7.0, np.inf]


def test_the_first_pose_stays_and_the_input_is_not_touched():
    truth = ring()
    begin = start(truth)
    before = begin.tobytes()
    solved, _ = relax_graduated(begin, edges_of(truth, chain(20)), np.zeros(19, dtype=bool), 16.27)
    assert begin.tobytes() == before and np.array_equal(solved[0], begin[0])


def test_edges_that_agree_after_all_are_believed_again_and_others_are_not() -> None:
    truth = ring()
    good = edges_of(truth, [(0, 10), (3, 13), (6, 16), (2, 18)])
    far = Edges(np.array([0]), np.array([7]), np.array([[3.0, 3.0, 1.0]]), TIGHT[None])
    edges = Edges.joined([edges_of(truth, chain(20), np.diag([400.0, 400.0, 2500.0])), good, far])
    doubtful = np.arange(edges.first.size) >= 19
    pulled = truth + np.linspace(0.0, 1.0, 20)[:, None] * np.array([0.1, 0.0, 0.0])  # as a wrong edge may leave it
    bound = 16.27
    weight = np.where(doubtful, 0.0, 1.0)
    assert (edges.chi2(pulled)[19:23] > bound).all()
    solved, believed = relax_again(start(truth), pulled, edges, doubtful, weight, bound)
    assert believed.tolist() == [1.0] * 23 + [0.0]
    assert np.abs(solved - truth).max() < 0.01
    torn = truth + np.linspace(0.0, 1.0, 20)[:, None] * np.array([5.0, 0.0, 0.0])
    kept, believed = relax_again(start(truth), torn, edges, doubtful, weight, bound)
    assert kept is torn and not believed[19:].any()  # nothing within reach


def test_a_second_try_that_believes_fewer_edges_is_not_taken() -> None:
    truth = ring(12)
    good = edges_of(truth, [*chain(12), (11, 0), (0, 6), (3, 9)])
    near = Edges(np.array([2]), np.array([8]), se2.between(truth[[2]], truth[[8]]), TIGHT[None])
    near.T_first_second[0, 0] += 0.08
    edges = Edges.joined([good, near])  # the last one misses by four times the bound: it is tried again
    doubtful, weight = np.ones(15, dtype=bool), np.append(np.ones(14), 0.0)
    begin = truth + np.random.default_rng(2).normal(0.0, (6.0, 6.0, 2.5), truth.shape)  # nothing is found from there
    begin[0] = truth[0]
    solved, believed = relax_again(begin, truth, edges, doubtful, weight, 16.27)
    assert solved is truth and believed is weight


def test_an_edge_that_misses_by_far_bends_less_where_it_may_be_wrong() -> None:
    truth = ring()
    wrong = Edges(np.array([0]), np.array([10]), np.array([[0.0, 12.0, np.pi]]), TIGHT[None])
    edges = Edges.joined([edges_of(truth, [*chain(20), (19, 0)]), wrong])
    robust = np.arange(edges.first.size) == 20
    off_m = [np.abs(relax(truth, edges, those) - truth).max() for those in (robust, np.zeros_like(robust))]
    assert off_m[0] < 0.1 * off_m[1] and off_m[1] > 0.1


def test_a_heading_stays_within_half_a_turn_either_way() -> None:
    begin = np.array([[0.0, 0.0, 3.0], [0.0, 0.0, 3.0]])
    edges = Edges(np.array([0]), np.array([1]), np.array([[1.0, 0.0, 0.5]]), TIGHT[None])
    solved = relax(begin, edges, np.zeros(1, dtype=bool))
    assert solved[1] == pytest.approx(se2.compose(begin[0], np.array([1.0, 0.0, 0.5])), abs=1e-3)
    assert solved[1, 2] < 0.0


def test_a_node_that_no_edge_holds_stays_where_it_is() -> None:
    truth = np.array([[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [7.0, 8.0, 1.0]])
    begin = truth + np.array([[0.0] * 3, [0.3, 0.2, 0.1], [0.0] * 3])
    solved = relax(begin, edges_of(truth, [(0, 1)]), np.zeros(1, dtype=bool))
    assert solved == pytest.approx(truth, abs=1e-3)


@pytest.mark.parametrize("count", [0, 1])
def test_nothing_to_relax(count):
    poses, weight = relax_graduated(np.zeros((count, 3)), Edges.none(), np.zeros(0, dtype=bool), 1.0)
    assert poses.shape == (count, 3) and weight.size == 0


def test_shifted_edges_are_those_of_later_nodes():
    edges = edges_of(ring(), chain(3)).shifted(4)
    assert edges.first.tolist() == [4, 5] and edges.second.tolist() == [5, 6]


def test_relaxation_spreads_a_loops_error() -> None:
    steps = np.tile([1.0, 0.0, np.pi / 10], (20, 1))
    truth = [np.zeros(3)]
    for step in steps:
        truth.append(se2.compose(truth[-1], step))
    drifted = [np.zeros(3)]
    for step in steps:
        drifted.append(se2.compose(drifted[-1], step + np.array([0.02, 0.01, 0.01])))
    poses, chain = np.stack(drifted), np.arange(20)
    T = np.concatenate([se2.between(poses[:-1], poses[1:]), [np.zeros(3)]])
    info = np.concatenate([np.tile(np.eye(3) * 100.0, (20, 1, 1)), [np.eye(3) * 1e6]])
    first, second = np.append(chain, 0), np.append(chain + 1, 20)
    robust = np.zeros(21, dtype=bool)
    relaxed = relax(poses, Edges(first, second, T, info), robust)
    assert np.abs(relaxed[-1]).max() < 1e-2
    assert np.hypot(*(relaxed - truth)[:, :2].T).max() < 0.4 * np.hypot(*(poses - truth)[:, :2].T).max()
    robust[-1] = True
    assert np.isfinite(relax(poses, Edges(first, second, T, info), robust)).all()


def test_relaxation_goes_on_until_it_settles() -> None:
    steps = np.tile([1.0, 0.0, np.pi / 10], (20, 1))
    poses = [np.zeros(3)]
    for step in steps:
        poses.append(se2.compose(poses[-1], step + np.array([0.02, 0.01, 0.06])))
    drifted, chain = np.stack(poses), np.arange(20)
    T = np.concatenate([se2.between(drifted[:-1], drifted[1:]), [np.zeros(3)]])
    info = np.concatenate([np.tile(np.eye(3) * 100.0, (20, 1, 1)), [np.eye(3) * 1e6]])
    edges = Edges(np.append(chain, 0), np.append(chain + 1, 20), T, info)
    robust = np.zeros(21, dtype=bool)
    relaxed = relax(drifted, edges, robust)
    assert np.abs(relaxed - drifted).max() > 0.5
    assert np.abs(relax(relaxed, edges, robust) - relaxed).max() < 1e-3


def test_a_marginal_is_what_sampled_edges_spread_to() -> None:
    poses, information = ring(8), np.diag([1e4, 4e4, 1e5])
    rng = np.random.default_rng(1)
    for pairs in (chain(8), [*chain(8), (7, 0)]):
        edges = edges_of(poses, pairs, information)
        ends = []
        for _ in range(400):
            noise = rng.multivariate_normal(np.zeros(3), np.linalg.inv(information), len(pairs))
            measured = edges._replace(T_first_second=edges.T_first_second + noise)
            ends.append(relax(poses, measured, np.zeros(len(pairs), bool))[5])
        off = np.array(ends) - poses[5]
        off[:, 2] = se2.wrap(off[:, 2])
        spread = np.cov(off.T)
        found = marginal(poses, edges, 5)
        assert np.allclose(np.sqrt(np.diag(found)), np.sqrt(np.diag(spread)), rtol=0.12)
        assert np.allclose(np.linalg.solve(spread, found), np.eye(3), atol=0.35)
    assert np.trace(found) < 0.7 * np.trace(marginal(poses, edges_of(poses, chain(8), information), 5))
    assert not marginal(poses, edges, 0).any()
