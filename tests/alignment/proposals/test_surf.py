"""Key points of SURF, and matches that respect the sign of the Laplacian."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig
from mrslam.alignment.proposals import features
from mrslam.alignment.proposals import surf as surf_module
from mrslam.alignment.proposals.surf import detect, surf


def blobs(places, sigma, sign=1.0, shape=(160, 200)):
    """Return a grey image with Gaussian blobs at (x, y) pixel centres."""
    y, x = np.mgrid[: shape[0], : shape[1]]
    grey = sum(np.exp(-((x - px) ** 2 + (y - py) ** 2) / (2 * sigma**2)) for px, py in places)
    return np.round(127 + sign * 120 * grey).astype(np.uint8)


@pytest.mark.parametrize("sigma", [2.6, 4.0, 8.0, 11.0])
def test_a_blob_is_found_below_the_pixel_and_at_its_scale(sigma):
    places = [(60.3, 70.8), (140.6, 80.1)]
    keys = detect(blobs(places, sigma), 2)
    for place in places:
        away = np.hypot(*(keys.at - place).T)
        k = int(np.argmin(away))
        assert away[k] < 0.1 + 0.02 * sigma
        assert 0.7 < keys.scale[k] / sigma < 1.4
        assert not keys.positive[k]


def test_scales_are_interpolated_between_the_filters():
    scales = [float(detect(blobs([(100.0, 80.0)], sigma), 1).scale[0]) for sigma in np.arange(2.6, 6.0, 0.4)]
    assert (np.diff(scales) > 0).all()


def test_a_dark_blob_has_a_positive_laplacian():
    assert detect(blobs([(60.0, 70.0)], 3.0, -1.0), 1).positive.all()


def test_at_least_three_octaves():
    assert len(surf_module.SIZES) >= 3
    assert [sizes[1] - sizes[0] for sizes in surf_module.SIZES] == [6 * 2**k for k in range(len(surf_module.SIZES))]


def test_no_blob_is_matched_with_one_of_the_other_sign(monkeypatch, sides):
    a, b = sides
    keys = [detect(features.picture(side)[0], 2000) for side in (a, b)]
    assert all(0.05 < k.positive.mean() < 0.95 for k in keys)
    seen = []

    def candidates_of(p_a, p_b, config):
        seen.append((p_a, p_b))
        return []

    monkeypatch.setattr(surf_module, "candidates_of", candidates_of)
    assert surf(a, b, AlignmentConfig(), None) == []
    matched = []
    for points, k, side in zip(seen[0], keys, (a, b), strict=True):
        at = (k.at + 0.5) * side.res + (side.x0, side.y0)
        nearest = [int(np.argmin(np.hypot(*(at - p).T))) for p in points]
        np.testing.assert_allclose(points, at[nearest], atol=1e-9)
        matched.append(k.positive[nearest])
    assert len(matched[0]) > 20
    np.testing.assert_array_equal(*matched)


def test_its_best_candidate_is_the_place(sides, pair):
    a, b = sides
    best = surf(a, b, AlignmentConfig(), None)[0]
    assert best.evidence["inliers"] >= 20
    assert math.hypot(*(best.T_a_b[:2] - pair[2][:2])) < 0.3 and abs(best.T_a_b[2] - pair[2][2]) < math.radians(1.0)
