"""Where a robot's own way came back to."""

import numpy as np
import pytest

from mrslam.merge.joint.normals import with_normals
from mrslam.merge.joint.trail import (
    NEAR_M,
    OLD_WAY_M,
    SEEN_AGAIN_EVERY_M,
    SEEN_AGAIN_M,
    SEEN_AGAIN_RAD,
    STEP_M,
    STEP_RAD,
    Trail,
    rigid,
)
from mrslam.spatial import Keyframes, KeyScans, LocalMap, OccupancyGrid, TiledMap, se2


def slow_twin(trail: Trail) -> list[tuple[int, int]]:
    found, last_m = [], -np.inf
    for j in range(len(trail)):
        old = int(np.searchsorted(trail.way_m, trail.way_m[j] - OLD_WAY_M))
        if old == 0 or trail.way_m[j] - last_m < SEEN_AGAIN_EVERY_M:
            continue
        away = np.hypot(*(trail.T_map_key[:old, :2] - trail.T_map_key[j, :2]).T)
        if away.min() < NEAR_M:
            found.append((int(np.argmin(away)), j))
            last_m = trail.way_m[j]
    return found


def test_places_seen_again_are_those_of_the_slow_twin() -> None:
    rng = np.random.default_rng(3)
    for count in (0, 1, 40, 400):
        steps = rng.normal(0.0, 0.4, (count, 2)) + 0.3 * np.sin(np.arange(count) / 15.0)[:, None]
        trail = Trail(np.column_stack([steps.cumsum(axis=0), np.zeros(count)]), KeyScans.empty())
        again = [pair for pair in zip(trail.edges.first, trail.edges.second, strict=True) if pair[1] != pair[0] + 1]
        assert again == slow_twin(trail)
    assert len(again) > 20


def test_a_way_is_as_stiff_as_it_is_short_and_straight_and_a_place_seen_again_is_known_to_centimetres() -> None:
    there = np.column_stack([np.arange(0.0, 20.5, 0.5), np.zeros(41), np.zeros(41)])
    trail = Trail(np.concatenate([there, there[::-1]]), KeyScans.empty())
    edges = trail.edges
    again = edges.second != edges.first + 1
    assert 3 <= again.sum() <= 10
    sigmas = 1.0 / np.sqrt(np.diagonal(edges.information, axis1=1, axis2=2))
    np.testing.assert_allclose(sigmas[again], [[SEEN_AGAIN_M, SEEN_AGAIN_M, SEEN_AGAIN_RAD]] * int(again.sum()))
    np.testing.assert_allclose(sigmas[0], [STEP_M + 0.005, STEP_M + 0.005, STEP_RAD + 0.0005])  # of half a metre
    turned = Trail(np.array([[0.0, 0.0, 0.0], [0.0, 0.0, 2.0], [1.0, 0.0, 2.0]]), KeyScans.empty()).edges
    sigmas = 1.0 / np.sqrt(np.diagonal(turned.information, axis1=1, axis2=2))
    np.testing.assert_allclose(
        sigmas, [[STEP_M + 0.01] * 2 + [STEP_RAD + 0.006], [STEP_M + 0.01] * 2 + [STEP_RAD + 0.001]]
    )


@pytest.mark.parametrize(("extent_m", "by_places"), [(0.5, False), (4.0, True)])
def test_a_robot_that_hardly_moved_is_laid_by_its_newest_pose_and_another_by_its_way(
    extent_m: float, by_places: bool
) -> None:
    T_b_key = np.array([[0.0, 0.0, 0.0], [extent_m, 0.0, 0.3]])
    T_a_b = se2.transform(2.0, -1.0, 0.7)
    T_a_key = se2.compose(T_a_b, T_b_key)
    T_a_key[0, 1] += 0.02  # a centimetre or two along half a metre is no heading
    found = rigid(T_a_key, T_b_key)
    assert (np.abs(found - T_a_b).max() < 1e-9) != by_places
    assert np.abs(found - T_a_b).max() < 0.03


@pytest.mark.parametrize(("scans", "keys"), [(KeyScans.blank(3), 3), (KeyScans.empty(), 0)])
def test_a_map_that_came_without_scans_has_no_way_to_be_bent_by(scans: KeyScans, keys: int) -> None:
    tiles = TiledMap.from_grid(OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.05), 1)
    keyframes = Keyframes(np.arange(3, dtype=np.int64), np.zeros((3, 3)))
    trail = Trail.of(LocalMap(tiles, keyframes, scans))
    assert len(trail) == len(trail.scans) == len(trail.stamps_ns) == keys


def test_points_without_a_normal_look_towards_the_laser_that_saw_them() -> None:
    wall = np.column_stack([np.linspace(-1.0, 1.0, 40), np.full(40, 2.0)])
    lone = np.array([[3.0, -1.0], [-3.0, -2.0]])
    laser = np.array([0.2, -0.1])
    points = with_normals(np.concatenate([lone[:1], wall, lone[1:]]).astype(np.float32), laser.astype(np.float32))
    assert (points[1:-1, 4] > 0.5).all() and np.allclose(points[1:-1, 2:4], [0.0, -1.0], atol=1e-3)
    toward = (laser - lone) / np.linalg.norm(laser - lone, axis=1, keepdims=True)
    assert not points[[0, -1], 4].any() and np.allclose(points[[0, -1], 2:4], toward, atol=1e-5)
