"""Descent from a poor start."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.matching.gauss_newton import match
from mrslam.spatial.matching.scan_points import scan_points, spaced
from tests.rbpf.rooms import seen_room


def test_match_finds_the_pose_from_a_poor_start() -> None:
    store, points = seen_room(noise=0.01)
    for start in ((0.06, -0.05, 0.02), (-0.08, 0.03, -0.03), (0.0, 0.1, 0.0)):
        T = np.array(start)
        found = match(store.tiles(0), points, T, T, np.zeros((3, 3)), 0.03, 15)
        assert np.abs(found.pose[:2]).max() < 0.006 and abs(found.pose[2]) < 0.002
        assert found.inliers > 0.95 and found.conflicts < 0.02
        assert (np.linalg.eigvalsh(found.information) > 0).all()


def test_match_keeps_to_a_strong_prior_and_survives_an_empty_map() -> None:
    store, points = seen_room()
    T = np.array([0.05, 0.0, 0.0])
    held = match(store.tiles(0), points, T, T, np.diag([1e9] * 3), 0.03, 10)
    assert np.abs(held.pose - T).max() < 1e-3
    lost = match(TileStore(1, 0.05).tiles(0), points, T, T, np.diag([1.0] * 3), 0.03, 10)
    assert np.allclose(lost.pose, T) and lost.inliers == 0.0


def test_a_bare_corridor_tells_nothing_of_the_way_along_it() -> None:
    angles = np.radians(np.arange(-90.0, 91.0, 1.0))
    ranges = np.minimum(1.2 / np.maximum(np.abs(np.sin(angles)), 1e-3), 5.6)
    ranges = np.where(ranges < 5.6, ranges + np.random.default_rng(2).normal(0.0, 0.02, angles.size), np.nan)
    points = np.zeros((angles.size, 5))
    n = scan_points(ranges.astype(np.float32), np.cos(angles), np.sin(angles), np.zeros(3), 30.0, points)
    store = TileStore(1, 0.05)
    store.add_points(0, np.zeros(3), points[:n])
    few = np.zeros_like(points)
    few = few[: spaced(points[:n], np.zeros(2), 0.03, 180, few)]
    moved = np.array([0.15, 0.04, 0.02])
    prior = np.diag([1.0 / 0.05**2] * 3)
    found = match(store.tiles(0), few, moved, moved, prior, 0.03, 12)
    assert found.blind > 0.9 and abs(found.blind_direction[0]) > 0.99
    assert abs(found.pose[0] - 0.15) < 0.02 and abs(found.pose[1]) < 0.01 and abs(found.pose[2]) < 0.005
    assert found.information[0, 0] < 0.02 * found.information[1, 1]
    store, points = seen_room()
    assert match(store.tiles(0), points, np.zeros(3), np.zeros(3), prior, 0.03, 12).blind == 0.0


@pytest.mark.parametrize("seed", [1882, 2287, 2484])
def test_information_is_never_negative_where_a_corridor_just_ends(seed: int) -> None:
    """Three of 3000 cluttered corridors where the direction that is blind was another one step before."""
    rng = np.random.default_rng(seed)
    angles = np.radians(np.arange(-90.0, 91.0, 3.0))
    ranges = np.minimum(1.5 / np.maximum(np.abs(np.sin(angles)), 1e-3), 6.0)
    clutter = rng.random(angles.size) < rng.uniform(0.0, 0.3)
    ranges = np.where(clutter, ranges * rng.uniform(0.3, 1.0, angles.size), ranges)
    ranges = np.where(ranges < 6.0, ranges + rng.normal(0.0, 0.02, angles.size), np.nan)
    points = np.zeros((angles.size, 5))
    points = points[: scan_points(ranges.astype(np.float32), np.cos(angles), np.sin(angles), np.zeros(3), 30.0, points)]
    store = TileStore(1, 0.05)
    store.add_points(0, np.zeros(3), points)
    start = rng.normal(0.0, [0.1, 0.1, 0.05])
    found = match(store.tiles(0), points, start, start, np.diag([1.0 / 0.2**2] * 3), 0.03, int(rng.integers(0, 8)))
    least, _, most = np.linalg.eigvalsh(found.information)
    assert least > -1e-9 * most


def test_one_step_leads_no_farther_than_walls_belong_together() -> None:
    nothing, points = TileStore(1, 0.05).tiles(0), seen_room()[1]
    sure = np.diag([1e6] * 3)
    for prior, expected in (
        ([3.0, -4.0, 1.0], [0.18, -0.24, 0.06]),
        ([0.0, 0.0, 1.0], [0.0, 0.0, 0.2]),
        ([0.0, 0.0, -1.0], [0.0, 0.0, -0.2]),
        ([0.1, 0.0, 0.1], [0.1, 0.0, 0.1]),
    ):
        found = match(nothing, points, np.zeros(3), np.array(prior), sure, 0.03, 1)
        np.testing.assert_allclose(found.pose, expected, atol=1e-6)


@pytest.mark.parametrize(("start", "told"), [(3.1, -3.1), (-3.1, 3.1), (3.1, 3.05)])
def test_a_prior_beyond_half_a_turn_is_reached_the_short_way(start: float, told: float) -> None:
    nothing, points = TileStore(1, 0.05).tiles(0), seen_room()[1]
    found = match(nothing, points, np.array([0.0, 0.0, start]), np.array([0.0, 0.0, told]), np.diag([1e6] * 3), 0.03, 4)
    assert found.pose[2] == pytest.approx(told, abs=1e-6)
