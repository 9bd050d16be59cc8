import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrslam.spatial.distance import FAR, euclidean, manhattan

masks = arrays(np.bool_, st.tuples(st.integers(1, 14), st.integers(1, 14)))


def naive(mask, metric):
    """Every cell against every true cell."""
    true = np.argwhere(mask)
    out = np.empty(mask.shape)
    for cell in np.ndindex(mask.shape):
        out[cell] = min((metric(cell[0] - r, cell[1] - c) for r, c in true), default=np.inf)
    return out


@settings(deadline=None)
@given(masks)
def test_euclidean_is_the_distance_to_the_nearest(mask):
    wanted = naive(mask, np.hypot)
    wanted[np.isinf(wanted)] = FAR
    np.testing.assert_allclose(euclidean(mask), wanted, rtol=1e-6)


@settings(deadline=None)
@given(masks, st.floats(0.0, 9.0))
def test_distances_are_looked_for_as_far_as_asked(mask, most):
    far = euclidean(mask)
    near = euclidean(mask, most)
    assert np.array_equal(near[near < FAR], far[near < FAR])
    assert (near[far < most - 1e-3] < FAR).all() and (near[far > most + 1e-3] == FAR).all()


@settings(deadline=None)
@given(masks)
def test_manhattan_is_the_distance_to_the_nearest(mask):
    wanted = naive(mask, lambda dr, dc: abs(dr) + abs(dc))
    wanted[np.isinf(wanted)] = sum(mask.shape)
    np.testing.assert_array_equal(manhattan(mask), wanted)


@pytest.mark.parametrize("shape", [(1, 500), (500, 1), (90, 110)])
def test_sparse_and_long_masks(shape):
    mask = np.zeros(shape, dtype=bool)
    mask[0, 0] = mask[-1, -1] = True
    np.testing.assert_allclose(euclidean(mask), naive(mask, np.hypot), rtol=1e-6)


@pytest.mark.parametrize("shape", [(0, 0), (0, 5), (5, 0)])
def test_no_cells_no_distances(shape):
    assert euclidean(np.zeros(shape, dtype=bool)).shape == shape
    assert manhattan(np.zeros(shape, dtype=bool)).shape == shape
