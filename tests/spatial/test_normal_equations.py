import numpy as np
import pytest

from mrslam.spatial import se2
from mrslam.spatial.normal_equations import NormalEquations
from mrslam.spatial.pose_graph import Edges


def made_up(seed: int, count: int, links: int) -> tuple[np.ndarray, Edges, np.ndarray]:
    """A chain and links to and fro between any two of its poses, with the weight of each."""
    rng = np.random.default_rng(seed)
    poses = rng.normal(0.0, (5.0, 5.0, 2.0), (count, 3))
    ends = np.array([rng.permutation(count)[:2] for _ in range(links)], dtype=np.int64).reshape(-1, 2)
    first, second = np.concatenate([np.stack([np.arange(count - 1), np.arange(1, count)], axis=1), ends]).T
    half = rng.normal(0.0, 30.0, (first.size, 3, 3))
    T = se2.between(poses[first], poses[second]) + rng.normal(0.0, 0.1, (first.size, 3))
    return poses, Edges(first, second, T, half @ half.transpose(0, 2, 1)), rng.uniform(0.0, 1.0, first.size)


def dense(poses: np.ndarray, edges: Edges, weight: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The equations of all poses but the first, by differences of the residuals."""
    flat, step = poses.ravel(), 1e-6
    J = np.zeros((edges.first.size, 3, flat.size))
    for k in range(flat.size):
        off = np.zeros(flat.size)
        off[k] = step
        after, before = (edges.residuals((flat + way * off).reshape(-1, 3)) for way in (1.0, -1.0))
        J[:, :, k] = (after - before) / (2.0 * step)
    W = edges.information * weight[:, None, None]
    H, g = np.einsum("eki,ekl,elj->ij", J, W, J), -np.einsum("eki,ekl,el->i", J, W, edges.residuals(poses))
    return H[3:, 3:], g[3:]


@pytest.mark.parametrize(("count", "links"), [(2, 0), (3, 4), (12, 9), (30, 60)])
def test_the_solution_is_that_of_the_dense_equations(count: int, links: int) -> None:
    for seed in range(3):
        poses, edges, weight = made_up(seed, count, links)
        equations = NormalEquations(edges.first, edges.second, count)
        H, g = dense(poses, edges, weight)
        for _ in range(2):  # the layout serves again
            factors, right = equations.factorised(poses, edges.residuals(poses), edges.information, weight)
            assert right.ravel() == pytest.approx(g, rel=1e-5, abs=1e-4 * np.abs(g).max())
            assert H @ factors.solve(right).ravel() == pytest.approx(g, abs=1e-4 * np.abs(g).max())


def test_a_grid_of_poses_fills_in_little() -> None:
    """Of the dense factor's 79,800 blocks below the diagonal 19 by row are a band's; minimum degree needs fewer."""
    node = np.arange(400).reshape(20, 20)
    right, down = (node[:, :-1].ravel(), node[:, 1:].ravel()), (node[:-1].ravel(), node[1:].ravel())
    first, second = np.concatenate([right, down], axis=1)
    equations = NormalEquations(first, second, 400)
    zero, eye = np.zeros((first.size, 3)), np.tile(np.eye(3), (first.size, 1, 1))
    factors, _ = equations.factorised(np.zeros((400, 3)), zero, eye, np.ones(first.size))
    assert len(factors.blocks) < 0.5 * 400 * 19


@pytest.mark.parametrize("surely", [1.0, 1e14])  # beside the greater one what is added to the diagonal is nothing
def test_poses_that_nothing_holds_are_not_moved(surely: float) -> None:
    poses, edges, weight = made_up(1, 8, 0)
    both = Edges.joined([edges, edges.shifted(8)])  # the second chain is not tied to the one whose first pose is held
    all_poses = np.concatenate([poses, poses, np.ones((1, 3))])
    equations = NormalEquations(both.first, both.second, 17)
    error = np.zeros((both.first.size, 3))
    error[:7] = both.residuals(all_poses)[:7]
    factors, right = equations.factorised(all_poses, error, surely * both.information, np.append(weight, weight))
    step = factors.solve(right)
    assert np.abs(step[:7]).min() > 0.0 and not step[7:].any()
