"""From matched points to transforms."""

from __future__ import annotations

import cv2
import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig
from mrslam.alignment.prepared import prepare
from mrslam.alignment.proposals import features
from mrslam.alignment.proposals.surf import surf
from mrslam.spatial import OccupancyGrid, se2

ONE, OTHER = se2.transform(3.0, -1.0, 2.0), se2.transform(-5.0, 4.0, -1.0)


def matched(counts: tuple[int, int, int]) -> tuple[np.ndarray, np.ndarray]:
    """Return points of a and b that so many times agree with one transform, with another, and with none."""
    rng = np.random.default_rng(5)
    p_b = rng.uniform(-10, 10, (sum(counts), 2))
    first, second = counts[0], counts[0] + counts[1]
    p_a = np.concatenate([se2.apply(ONE, p_b[:first]), se2.apply(OTHER, p_b[first:second]), p_b[second:] ** 2])
    return p_a, p_b


def test_what_one_transform_leaves_over_gives_the_next() -> None:
    found = features.candidates_of(*matched((30, 12, 8)), AlignmentConfig())
    assert len(found) == 2
    for one, T, inliers in zip(found, (ONE, OTHER), (30, 12), strict=True):
        np.testing.assert_allclose(one.T_a_b, T, atol=1e-6)
        confidence = inliers / (8.0 + 0.3 * 50)
        assert one.score == one.evidence["feature_confidence"] == pytest.approx(confidence)
        assert (one.evidence["matches"], one.evidence["inliers"]) == (50.0, inliers)


def test_a_handful_of_matches_that_agree_is_chance() -> None:
    assert len(features.candidates_of(*matched((5, 0, 0)), AlignmentConfig())) == 1
    assert features.candidates_of(*matched((4, 0, 0)), AlignmentConfig()) == []


def test_points_are_matched_only_where_each_is_the_others_nearest() -> None:
    one = np.array([[0, 0], [10, 0], [11, 0]], dtype=np.float32)
    other = np.array([[12, 0], [1, 0]], dtype=np.float32)
    i, j = features.matches(one, other, cv2.NORM_L2)
    assert sorted(zip(i.tolist(), j.tolist(), strict=True)) == [(0, 1), (2, 0)]
    assert len(features.matches(one[:0], other, cv2.NORM_L2)[0]) == 0


def test_a_picture_that_is_halved_has_pixels_twice_as_large() -> None:
    side = prepare(OccupancyGrid(np.zeros((1990, 2990), np.int8), 0.05), 0.05)
    image, pixel_m = features.picture(side)
    assert pixel_m == pytest.approx(0.1)
    assert image.shape == pytest.approx(np.array(side.state.shape) / 2.0, abs=1.0)


def test_key_points_of_orb_are_the_middles_of_cells(monkeypatch: pytest.MonkeyPatch, sides: tuple) -> None:
    seen: list[np.ndarray] = []
    monkeypatch.setattr(features, "candidates_of", lambda p_a, p_b, config: seen.extend((p_a, p_b)) or [])
    features.orb(*sides, AlignmentConfig(), None)
    for points, side in zip(seen, sides, strict=True):
        in_cells = (points - (side.x0, side.y0)) / side.res - 0.5
        is_whole = (np.abs(in_cells - np.rint(in_cells)) < 1e-6).all(axis=1)  # those of the finest level
        assert is_whole.mean() > 0.25


@pytest.mark.parametrize("propose", [features.orb, surf])
def test_where_parts_of_a_map_fit_at_two_places_both_are_proposed(propose, house) -> None:
    """The right half of one map lies 2 m higher in the other, as where a mapper lost its way in the middle."""
    cells, torn = house.cells, np.full_like(house.cells, -1)
    torn[:, :260], torn[40:, 260:] = cells[:, :260], cells[:-40, 260:]
    a, b = (prepare(OccupancyGrid(each, 0.05), 0.05) for each in (torn, cells))
    found = propose(a, b, AlignmentConfig(), None)
    for shift_m in (0.0, 2.0):
        assert min(np.abs(each.T_a_b - (0.0, shift_m, 0.0)).max() for each in found) < 0.15
