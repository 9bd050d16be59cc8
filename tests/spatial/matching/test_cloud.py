"""Points of several scans as if one had seen them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import se2
from mrslam.spatial.matching.cloud import joined, transformed
from mrslam.spatial.matching.scan_points import NORMAL_REACH_M, POINT_COLUMNS

ORIGIN = np.array([0.0, 0.0])


def bare(places: list[tuple[float, float]]) -> NDArray[np.float64]:
    """Return points without normals."""
    points = np.zeros((len(places), POINT_COLUMNS))
    points[:, :2] = places
    return points


def wall(first: float, last: float, step: float) -> NDArray[np.float64]:
    """Return a wall two metres to the right of the origin, along y."""
    return bare([(2.0, float(y)) for y in np.arange(first, last, step)])


def test_points_and_normals_are_turned_and_points_shifted() -> None:
    points = np.array([[1.0, 2.0, 0.6, 0.8, 0.5], [3.0, -1.0, 0.0, -1.0, 0.9]])
    T = np.array([0.3, -0.7, 1.1])
    out = transformed(points, T)
    np.testing.assert_allclose(out[:, :2], se2.apply(T, points[:, :2]))
    np.testing.assert_allclose(out[:, 2:4], se2.apply(np.array([0.0, 0.0, 1.1]), points[:, 2:4]))
    np.testing.assert_array_equal(out[:, 4], points[:, 4])


def test_points_are_in_the_order_of_their_bearings_whichever_scan_they_are_of() -> None:
    out = joined([wall(-1.0, 1.0, 0.21), wall(-1.0, 1.0, 0.17)], ORIGIN)
    bearings = np.arctan2(out[:, 1], out[:, 0])
    assert (np.diff(bearings) >= 0.0).all() and len(out) == 22


def test_sparse_scans_give_a_wall_normals_together_that_look_to_where_it_was_seen_from() -> None:
    step = 1.2 * NORMAL_REACH_M
    scans = [wall(-1.0 + shift * step, 1.0, step) for shift in (0.0, 0.25, 0.5, 0.75)]
    assert not joined(scans[:1], ORIGIN)[:, 4].any()
    for origin, normal in ((ORIGIN, (-1.0, 0.0)), (np.array([4.0, 0.0]), (1.0, 0.0))):
        out = joined(scans, origin)
        inner = np.abs(out[:, 1]) < 0.6
        assert inner.sum() > 10 and (out[inner, 4] > 0.5).all()
        np.testing.assert_allclose(out[inner, 2:4], np.tile(normal, (inner.sum(), 1)), atol=1e-6)


def test_a_point_with_few_others_around_keeps_the_normal_of_its_own_scan() -> None:
    lonely = np.array([[2.0, side * 0.9 * NORMAL_REACH_M, -0.6, 0.8, 0.7] for side in (-1, 0, 1)])
    np.testing.assert_allclose(joined([lonely], ORIGIN)[:, 2:], lonely[:, 2:])


def test_noise_of_one_spot_has_no_direction() -> None:
    angles = np.linspace(0.0, 2.0 * math.pi, 12, endpoint=False)
    spot = bare([(2.0 + 0.003 * math.cos(a), 0.02 * math.sin(a)) for a in angles])
    assert not joined([spot], ORIGIN)[:, 4].any()
