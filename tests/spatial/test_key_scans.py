"""Keyframes' scans: what is kept of them, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from mrslam.spatial import InputError, KeyScans
from mrslam.spatial.key_scans import BEARINGS, KEYFRAMES_MOST, POINTS_MOST, RANGE_M


def some(seed: int, keyframes: int, most: int = POINTS_MOST, reach_m: float = 30.0) -> KeyScans:
    rng = np.random.default_rng(seed)
    scans = [rng.uniform(-reach_m, reach_m, (int(rng.integers(most + 1)), 2)) for _ in range(keyframes)]
    return KeyScans.of_points(scans, rng.uniform(-0.5, 0.5, (keyframes, 2)))


def nearest_m(points: NDArray[np.float64], others: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.hypot(*(points[:, None] - others).transpose(2, 0, 1)).min(axis=1)


@given(st.integers(0, 2**32 - 1))
def test_every_point_is_kept_to_within_the_steps(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.uniform(-30.0, 30.0, (POINTS_MOST, 2))
    origin = np.array([0.213, -0.35])
    kept = KeyScans.of_points([points], [origin]).of(0)
    assert kept.shape == points.shape
    reach = np.hypot(*(points - origin).T)
    bound = np.hypot(0.5 * RANGE_M, np.pi / BEARINGS * reach) + 1e-5
    assert (nearest_m(points, kept.astype(np.float64)) <= bound).all()


@given(st.integers(0, 2**32 - 1))
def test_quantising_again_changes_nothing(seed: int) -> None:
    scans = some(seed, 3)
    again = KeyScans.of_points([scans.of(k).astype(np.float64) for k in range(3)], scans.origins)
    assert again.equals(scans)
    assert again.points.tobytes() == scans.points.tobytes()


def test_points_lie_where_bearing_and_range_say() -> None:
    ahead, left, behind = (4096, 100), (6144, 50), (0, 1)
    scans = KeyScans(
        np.array([0, 1, 3], np.int32),
        np.array([ahead, behind, left], np.uint16),
        np.array([[0.0, 0.0], [0.5, -0.25]], np.float32),
    )
    np.testing.assert_allclose(scans.of(0), [[2.0, 0.0]], atol=1e-6)
    np.testing.assert_allclose(scans.of(1), [[0.48, -0.25], [0.5, 0.75]], atol=1e-6)


def test_parts_put_together_are_the_whole() -> None:
    scans = some(1, 7)
    parts = [scans.part(0, 3), scans.part(3, 3), scans.part(3, 7)]
    assert [len(part) for part in parts] == [3, 0, 4]
    np.testing.assert_array_equal(parts[2].of(1), scans.of(4))
    assert KeyScans.concatenate(parts).equals(scans)
    assert parts[0].append(parts[2]).equals(scans)
    assert not parts[0].append(parts[0]).equals(scans)


def test_no_keyframes_and_keyframes_without_points() -> None:
    assert len(KeyScans.empty()) == 0
    blind = KeyScans.of_points([np.empty((0, 2)), np.empty((0, 2))], np.zeros((2, 2)))
    assert len(blind) == 2
    assert blind.of(1).shape == (0, 2)


def test_what_no_number_holds_is_left_out() -> None:
    points = np.array([[1e-3, 0.0], [1e6, 0.0], [1.0, 0.0]])
    np.testing.assert_allclose(KeyScans.of_points([points], [[0.0, 0.0]]).of(0), [[1.0, 0.0]], atol=1e-6)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"starts": [0, 5]}, "the number of points"),
        ({"starts": [1, 2]}, "the number of points"),
        ({"starts": [0, 3, 2], "origins": [[0, 0], [0, 0]]}, "the number of points"),
        ({"starts": []}, "starts must be"),
        ({"starts": [0, 1, 2]}, r"origins must be \(2, 2\)"),
        ({"polar": [[1, 1, 1], [1, 1, 1]]}, r"polar must be \(P, 2\) uint16"),
        ({"polar": [[2, 1], [1, 1]]}, "ascend within a keyframe"),
        ({"polar": [[BEARINGS, 1], [BEARINGS, 1]]}, "bearings must be below"),
        ({"polar": [[1, 0], [1, 1]]}, "ranges above 0"),
        ({"origins": [[np.nan, 0]]}, "finite"),
        ({"origins": [[31.0, 0]]}, "within 30 m"),
        ({"origins": [[0.0005, 0]]}, "whole millimetres"),
        ({"starts": [0, 61], "polar": [[1, 1]] * 61}, "61 points, at most 60"),
    ],
)
def test_what_contradicts_itself_is_refused(change: dict[str, object], message: str) -> None:
    fields = {"starts": [0, 2], "polar": [[1, 1], [2, 1]], "origins": [[0.0, 0.0]]} | change
    with pytest.raises(InputError, match=message):
        KeyScans(
            np.array(fields["starts"], np.int32),
            np.array(fields["polar"], np.uint16),
            np.array(fields["origins"], np.float32),
        )


def test_more_keyframes_than_indices_can_count_are_refused() -> None:
    with pytest.raises(InputError, match=f"K <= {KEYFRAMES_MOST}"):
        KeyScans(np.zeros(KEYFRAMES_MOST + 2, np.int32), np.empty((0, 2), np.uint16), np.empty((0, 2), np.float32))


def test_a_wrong_number_type_is_refused() -> None:
    with pytest.raises(InputError, match="uint16"):
        KeyScans(np.array([0, 1], np.int32), np.array([[1, 1]]), np.zeros((1, 2), np.float32))


@given(st.integers(0, 2**32 - 1), st.integers(0, 6))
def test_a_keyframe_begins_where_the_one_before_ends(seed: int, keyframes: int) -> None:
    scans = some(seed, keyframes)
    assert len(scans) == keyframes
    assert sum(len(scans.of(k)) for k in range(keyframes)) == scans.points.shape[0]


def test_points_in_another_order_are_the_same_scan() -> None:
    points = np.array([[2.0, 0.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]])  # two in one direction
    one, other = (KeyScans.of_points([way], [[0.0, 0.0]]) for way in (points, points[::-1]))
    assert one.equals(other) and len(one.of(0)) == 4


def test_a_laser_a_hair_left_or_right_of_the_middle_has_the_same_bytes() -> None:
    left, right = (KeyScans.of_points([np.ones((1, 2))], [[0.0, y]]) for y in (1e-4, -1e-4))
    assert left.origins.tobytes() == right.origins.tobytes()


def test_directions_are_of_the_map() -> None:
    one = KeyScans.of_points([np.array([[2.0, 0.2]])] * 3, np.zeros((3, 2)))
    poses = np.array([[0.0, 0.0, 0.0], [5.0, 5.0, np.pi / 2], [0.0, 0.0, -np.pi / 4]])
    assert [list(np.flatnonzero(row)) for row in one.directions(poses)] == [[0], [2], [7]]
    assert not KeyScans.blank(3).directions(poses).any()
