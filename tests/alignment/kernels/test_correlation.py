"""Loops of the correlation against slow twins."""

from __future__ import annotations

import numpy as np

from mrslam.alignment.kernels import correlation as correlate_kernels


def test_products_of_spectra_like_their_twin():
    rng = np.random.default_rng(5)
    one, two = ((rng.normal(size=(5, 6, 4)) + 1j * rng.normal(size=(5, 6, 4))).astype(np.complex64) for _ in range(2))
    out = np.empty((2, 6, 4), dtype=np.complex64)
    correlate_kernels.multiply(one, two, out)
    np.testing.assert_allclose(out[0], (one * two.conj()).sum(axis=0), rtol=1e-4, atol=1e-4)
    np.testing.assert_allclose(out[1], (one * two[[2, 3, 0, 1, 4]]).sum(axis=0), rtol=1e-4, atol=1e-4)


def test_peaks_like_sorting():
    score = np.random.default_rng(0).normal(0, 1, (40, 50)).astype(np.float32)
    where, value = correlate_kernels.peaks(score, 5, 2)
    assert (np.diff(value) <= 0).all()
    assert value[0] == score.max()
    assert tuple(where[0]) == np.unravel_index(int(score.argmax()), score.shape)
    for i in range(5):
        for j in range(i):
            gap = np.abs(where[i] - where[j])
            assert np.minimum(gap, np.array(score.shape) - gap).max() > 2


def test_walls_are_drawn_bilinearly_by_the_axes_that_they_face_and_wrap_around():
    angle = 0.3
    points, normals = np.array([[1.03, -0.52], [-2.2, 0.1]]), np.array([[0.6, 0.8], [-1.0, 0.0]])
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    out = np.zeros((4, 12, 16), dtype=np.float32)
    correlate_kernels.cyclic_splat(points, normals, np.cos(angle), np.sin(angle), 0.2, -5, out)
    expected = np.zeros((4, 12, 16))
    for (x, y), (nx, ny) in zip(points @ turn.T / 0.2, normals @ turn.T, strict=True):
        for r in range(int(np.floor(y)), int(np.floor(y)) + 2):
            for c in range(int(np.floor(x)), int(np.floor(x)) + 2):
                share = (1.0 - abs(x - c)) * (1.0 - abs(y - r))
                expected[0 if nx > 0 else 2, (r + 5) % 12, c % 16] += share * abs(nx)
                expected[1 if ny > 0 else 3, (r + 5) % 12, c % 16] += share * abs(ny)
    np.testing.assert_allclose(out, expected, atol=1e-6)


def test_clutter_is_capped_in_every_channel():
    out = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
    correlate_kernels.soft_cap(out, 5.0)
    np.testing.assert_array_equal(out, np.minimum(np.arange(24).reshape(2, 3, 4), 5.0))


def test_free_cells_are_counted_at_the_nearest_index_and_wrap_around():
    out = np.zeros((6, 8), dtype=np.float32)
    correlate_kernels.cyclic_count(np.array([[0.29, 0.1], [-0.35, -0.9]]), 1.0, 0.0, 0.2, 0.5, -2, out)
    expected = np.zeros((6, 8))
    expected[3 % 6, 1] = 0.5
    expected[(-4 + 2) % 6, -2 % 8] = 0.5
    np.testing.assert_array_equal(out, expected)


def test_deep_in_free_space_are_free_cells_without_a_wall_near():
    state = np.array([[1, 1, 1], [2, 1, 0], [1, 1, 1]], dtype=np.uint8)
    label = np.full((4, 3, 3), 65535, dtype=np.uint16)
    label[2, 0, 2] = label[0, 2, 0] = 7  # a wall of one facing is enough
    out = np.empty((9, 2), dtype=np.int32)
    assert correlate_kernels.deep_free(state, label, 1, out) == 5
    assert out[:5].tolist() == [[0, 0], [0, 1], [1, 1], [2, 1], [2, 2]]
    assert correlate_kernels.deep_free(state, label, 2, out) == 2
    assert out[:2].tolist() == [[0, 0], [2, 2]]


def test_of_peaks_near_each_other_around_the_edge_as_well_the_higher_counts():
    score = np.zeros((20, 30), dtype=np.float32)
    score[0, 5], score[19, 6] = 3.0, 4.0  # neighbours over the edge
    score[9, 10], score[11, 12] = 1.0, 2.0  # the lower comes first
    score[10, 28], score[10, 1] = 5.0, 4.5  # three columns apart over the edge
    where, value = correlate_kernels.peaks(score, 5, 3)
    assert [tuple(at) for at in where.tolist()] == [(10, 28), (19, 6), (11, 12)]
    np.testing.assert_array_equal(value, [5.0, 4.0, 2.0])


def test_the_side_of_a_ridge_is_no_peak():
    score = np.zeros((9, 9), dtype=np.float32)
    score[3:6, 4] = 1.0, 2.0, 1.5
    where, _ = correlate_kernels.peaks(score, 4, 0)
    assert where.tolist() == [[4, 4]]
