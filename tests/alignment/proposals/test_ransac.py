"""Rigid transforms of matches with many wrong ones."""

from __future__ import annotations

import numpy as np

from mrslam.alignment.proposals import ransac
from mrslam.spatial import se2


def test_ransac_finds_the_inliers():
    rng = np.random.default_rng(5)
    T = se2.transform(3.0, -1.0, 2.0)
    p_b = rng.uniform(-10, 10, (60, 2))
    p_a = se2.apply(T, p_b) + rng.normal(0, 0.02, (60, 2))
    p_a[20:] = rng.uniform(-10, 10, (40, 2))
    fit = ransac.rigid(p_a, p_b, 3000, 0.2, np.random.default_rng(0))
    assert fit is not None
    np.testing.assert_allclose(fit[0], T, atol=0.03)
    assert fit[1][:20].all() and fit[1].sum() < 25


def test_ransac_gives_up_on_nothing():
    assert ransac.rigid(np.zeros((2, 2)), np.zeros((2, 2)), 10, 0.2, np.random.default_rng(0)) is None
    assert ransac.rigid(np.zeros((9, 2)), np.zeros((9, 2)), 10, 0.2, np.random.default_rng(0)) is None


def test_best_draw_like_its_twin():
    rng = np.random.default_rng(2)
    p_a, p_b = rng.uniform(0, 6, (25, 2)), rng.uniform(0, 6, (25, 2))
    draws = rng.integers(0, 25, (300, 2))
    k, most = ransac.best_draw(p_a, p_b, draws, 0.5)
    counts = []
    for i, j in draws:
        lengths = np.hypot(*(p_a[j] - p_a[i])), np.hypot(*(p_b[j] - p_b[i]))
        if lengths[1] < 2.5 or abs(lengths[0] - lengths[1]) > 1.0:
            counts.append(0)
            continue
        T = se2.fit_rigid(p_a[[i, j]], p_b[[i, j]])
        counts.append(int((np.hypot(*(se2.apply(T, p_b) - p_a).T) <= 0.5).sum()))
    assert most == max(counts)
    assert counts[k] == most


def test_two_matches_next_to_each_other_and_two_whose_distance_differs_give_no_transform():
    p_b = np.array([[0.0, 0.0], [3.0, 0.0], [0.9, 0.0], [0.0, 3.0]])
    p_a = np.array([[1.0, 1.0], [4.5, 1.0], [1.9, 1.0], [1.0, 4.3]])
    for draw, found in (((0, 1), -1), ((0, 2), -1), ((0, 3), 0), ((2, 2), -1)):
        assert ransac.best_draw(p_a, p_b, np.array([draw]), 0.2)[0] == found
