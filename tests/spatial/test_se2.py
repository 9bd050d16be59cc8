import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrslam.spatial import se2

metres = st.floats(-1e3, 1e3)
angles = st.floats(-math.pi, math.pi)
transforms = st.builds(se2.transform, metres, metres, angles)
points = st.tuples(metres, metres).map(np.array)


def close(one, two) -> bool:
    metres_apart, radians_apart = se2.difference(one, two)
    return metres_apart < 1e-7 and radians_apart < 1e-9


@given(transforms)
def test_identity_is_neutral_on_both_sides(T_a_b):
    assert close(se2.compose(se2.IDENTITY, T_a_b), T_a_b)
    assert close(se2.compose(T_a_b, se2.IDENTITY), T_a_b)


@given(transforms)
def test_inverse_cancels_on_both_sides(T_a_b):
    assert close(se2.compose(T_a_b, se2.inverse(T_a_b)), se2.IDENTITY)
    assert close(se2.compose(se2.inverse(T_a_b), T_a_b), se2.IDENTITY)
    assert close(se2.inverse(se2.inverse(T_a_b)), T_a_b)


@given(transforms, transforms, transforms)
def test_composition_is_associative(T_a_b, T_b_c, T_c_d):
    left = se2.compose(se2.compose(T_a_b, T_b_c), T_c_d)
    right = se2.compose(T_a_b, se2.compose(T_b_c, T_c_d))
    assert close(left, right)


@given(transforms, transforms, points)
def test_a_product_acts_as_one_after_the_other(T_a_b, T_b_c, p_c):
    once = se2.apply(se2.compose(T_a_b, T_b_c), p_c)
    twice = se2.apply(T_a_b, se2.apply(T_b_c, p_c))
    np.testing.assert_allclose(once, twice, atol=1e-7)


@given(transforms, transforms)
def test_matrices_multiply_alike(T_a_b, T_b_c):
    product = se2.matrix(T_a_b) @ se2.matrix(T_b_c)
    np.testing.assert_allclose(se2.matrix(se2.compose(T_a_b, T_b_c)), product, atol=1e-7)


@given(transforms, transforms)
def test_between_is_what_leads_from_one_to_the_other(T_w_a, T_w_b):
    assert close(se2.compose(T_w_a, se2.between(T_w_a, T_w_b)), T_w_b)


@given(st.floats(-1e4, 1e4))
def test_wrapped_angles_are_the_same_direction_in_the_half_open_turn(angle):
    wrapped = float(se2.wrap(angle))
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-9)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-9)


@pytest.mark.parametrize("angle", [math.pi, -math.pi, 3 * math.pi, -5 * math.pi])
def test_half_a_turn_is_plus_pi(angle):
    assert float(se2.wrap(angle)) == pytest.approx(math.pi, abs=1e-12)
    assert float(se2.wrap(angle)) > 0


@pytest.mark.parametrize("angle", [np.nextafter(-np.pi, -4.0), np.nextafter(np.pi, 4.0), -1e-17, -1e-300])
def test_wrap_stays_in_range_next_to_its_ends(angle):
    assert -np.pi < float(se2.wrap(angle)) <= np.pi


def test_one_transform_gives_the_same_bytes_as_many():
    rng = np.random.default_rng(0)
    T_a_b, T_b_c = rng.normal(size=(2, 500, 3)) * [5.0, 5.0, 9.0]
    T_a_b[:4, 2] = [np.pi, -np.pi, 3 * np.pi, -1e-300]
    together, back = se2.compose(T_a_b, T_b_c), se2.inverse(T_a_b)
    for k in range(500):
        assert se2.compose(T_a_b[k], T_b_c[k]).tobytes() == together[k].tobytes()
        assert se2.inverse(T_a_b[k]).tobytes() == back[k].tobytes()
        assert se2.wrap(T_a_b[k, 2]) == se2.wrap(T_a_b[:, 2])[k]


def test_leading_axes_broadcast():
    many = np.stack([se2.transform(i, 2 * i, 0.1 * i) for i in range(4)])
    one = se2.transform(1.0, -2.0, 0.5)
    stacked = se2.compose(one, many)
    assert stacked.shape == (4, 3)
    for i in range(4):
        assert close(stacked[i], se2.compose(one, many[i]))
    assert se2.inverse(many).shape == (4, 3)
    assert se2.apply(many[:, None, :], np.zeros((4, 5, 2))).shape == (4, 5, 2)


@given(transforms, st.integers(2, 30), st.integers(0, 2**32 - 1))
def test_fit_rigid_finds_the_transform_of_matched_points(T_a_b, count, seed):
    p_b = np.random.default_rng(seed).normal(scale=10.0, size=(count, 2))
    found = se2.fit_rigid(se2.apply(T_a_b, p_b), p_b)
    np.testing.assert_allclose(se2.apply(found, p_b), se2.apply(T_a_b, p_b), atol=1e-6)


def test_fit_rigid_is_the_least_squares_fit():
    rng = np.random.default_rng(1)
    p_b = rng.normal(size=(40, 2))
    p_a = se2.apply(se2.transform(1.0, 2.0, 0.7), p_b) + rng.normal(scale=0.05, size=p_b.shape)
    best = se2.fit_rigid(p_a, p_b)
    error = np.sum((se2.apply(best, p_b) - p_a) ** 2)
    for step in np.vstack([np.eye(3), -np.eye(3)]) * 1e-3:
        assert np.sum((se2.apply(best + step, p_b) - p_a) ** 2) > error


def test_two_transforms_differ_at_a_point_by_what_they_make_of_it():
    one, two = se2.transform(1.0, 2.0, np.pi - 0.1), se2.transform(1.0, 2.0, 0.1 - np.pi)
    metres_apart, radians_apart = se2.difference_at(one, two, [10.0, 0.0])
    assert radians_apart == pytest.approx(0.2)
    assert metres_apart == pytest.approx(20.0 * np.sin(0.1))
    assert se2.difference_at(one, two, [0.0, 0.0])[0] == 0.0
    assert se2.difference(one, two)[0] == 0.0


def test_the_identity_cannot_be_written_to():
    with pytest.raises(ValueError, match="read-only"):
        se2.IDENTITY[0] = 1.0


def test_a_covariance_turns_with_its_frame():
    points = np.random.default_rng(0).multivariate_normal(np.zeros(3), np.diag([4.0, 1.0, 0.1]), 50)
    turned = np.column_stack([se2.apply([0.0, 0.0, 0.3], points[:, :2]), points[:, 2]])
    np.testing.assert_allclose(se2.turned_covariance(np.cov(points.T), 0.3), np.cov(turned.T))
