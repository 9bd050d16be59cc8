"""Covariances go along with the transforms, to first order: as derivatives taken by differences have them."""

from collections.abc import Callable

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from mrslam.alignment import Prior
from mrslam.merge.graph.carried import between, moved, seen_from, sigma_at, turned
from mrslam.spatial import se2
from tests.merge.plans import alignment

transforms = st.builds(se2.transform, st.floats(-20, 20), st.floats(-20, 20), st.floats(-3.1, 3.1))
SIGMAS = np.diag([0.02, 0.05, 0.004])
COVARIANCE = SIGMAS @ np.array([[1.0, 0.3, 0.1], [0.3, 1.0, -0.2], [0.1, -0.2, 1.0]]) @ SIGMAS


def found(T_a_b: np.ndarray):
    one = alignment(T_a_b)
    return type(one)(one.T_a_b, one.confidence, one.evidence, COVARIANCE, one.method)


def carried(function: Callable[[np.ndarray], np.ndarray], at: np.ndarray) -> np.ndarray:
    """Return the covariance of what a function makes of a transform ``at`` that has ``COVARIANCE``."""
    ways, step = [], 1e-6
    for d in np.eye(3) * step:
        way = function(at + d) - function(at - d)
        ways.append(np.append(way[:2], se2.wrap(way[2:])) / (2.0 * step))
    J = np.stack(ways, axis=1)
    return J @ COVARIANCE @ J.T


@given(transforms, transforms)
def test_an_alignment_of_another_map_of_the_same_cluster(T_a_b: np.ndarray, T: np.ndarray):
    for got, function in (
        (moved(found(T_a_b), T), lambda T_1_2: se2.compose(T, T_1_2)),
        (seen_from(found(T_a_b), T), lambda T_1_2: se2.compose(T_1_2, T)),
        (turned(found(T_a_b)), se2.inverse),
    ):
        assert se2.difference(got.T_a_b, function(T_a_b)) == (0.0, 0.0)
        np.testing.assert_allclose(got.covariance, carried(function, T_a_b), atol=1e-6)


@given(transforms, transforms)
def test_a_prior_between_two_known_poses_is_as_unsure_as_both(T_w_a: np.ndarray, T_w_b: np.ndarray):
    prior = between(T_w_a, T_w_b, COVARIANCE)
    assert se2.difference(prior.T_a_b, se2.between(T_w_a, T_w_b)) == (0.0, 0.0)
    both = carried(lambda T: se2.between(T, T_w_b), T_w_a) + carried(lambda T: se2.between(T_w_a, T), T_w_b)
    np.testing.assert_allclose(prior.covariance, both, atol=1e-6)


@given(transforms, st.floats(-20, 20), st.floats(-20, 20))
def test_a_place_is_the_less_sure_the_farther_it_is_from_the_maps_origin(T_a_b: np.ndarray, x_m: float, y_m: float):
    point = np.array([x_m, y_m])
    covariance = carried(lambda T: np.append(se2.apply(T, point), 0.0), T_a_b)[:2, :2]
    np.testing.assert_allclose(
        sigma_at(Prior(T_a_b, COVARIANCE), point) ** 2, np.linalg.eigvalsh(covariance)[-1], atol=1e-6
    )
