"""Which keyframes of two robots are compared."""

import numpy as np
import pytest

from mrslam.merge.joint.candidate_kernels import nearest_keys
from mrslam.merge.joint.candidates import COMPARED_EVERY_M, Candidate, candidates
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.local_match import FIRST_LOST_M
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import se2
from mrslam.spatial.key_scans import KeyScans
from mrslam.spatial.matching.places import FAR_MOST_M, NEAR_M, TURN_COST_M, within_m


def scans(keys: int) -> KeyScans:
    """Return scans of one point each."""
    return KeyScans.of_points([np.array([[1.0, 0.0]])] * keys, np.zeros((keys, 2)))


def straight(keys: int = 30) -> Trail:
    poses = np.stack([0.5 * np.arange(keys), np.zeros(keys), np.zeros(keys)], axis=1)
    return Trail(poses, scans(keys))


@pytest.mark.parametrize(
    ("away", "any_near"),
    [((0.0, 0.9 * NEAR_M), True), ((14.5 + 0.9 * NEAR_M, 0.0), True), ((0.0, 1.1 * FAR_MOST_M), False),
     ((-14.5 - 1.1 * FAR_MOST_M, 0.0), False)],
)  # fmt: skip
def test_keyframes_are_compared_where_the_ways_come_near(away, any_near):
    a, b = straight(), straight()
    poses = a.T_map_key, se2.compose(np.array([*away, 0.0]), b.T_map_key)
    found = candidates((a, b), poses, [], [])
    assert bool(found) is any_near
    for near in found:
        between = poses[1][near.j, :2] - poses[0][near.i, :2]
        assert np.hypot(*between) <= FAR_MOST_M


def test_a_robot_without_keyframes_is_compared_with_nobody():
    assert candidates((straight(), straight(0)), (straight().T_map_key, np.empty((0, 3))), [], []) == []
    assert candidates((straight(0), straight()), (np.empty((0, 3)), straight().T_map_key), [], []) == []


def test_the_nearest_keyframe_is_that_of_the_slow_twin():
    rng = np.random.default_rng(0)
    T_a, T_b = (rng.normal(size=(count, 3)) * [5.0, 5.0, 3.0] for count in (200, 150))
    T_a[:, 2], T_b[:, 2] = se2.wrap(T_a[:, 2]), se2.wrap(T_b[:, 2])
    T_b[:20, :2] += [40.0, 0.0]  # where nobody was
    nearest, away_m = nearest_keys(T_a, T_b, TURN_COST_M, FAR_MOST_M)
    near = 0
    for j, T in enumerate(T_b):
        away = np.hypot(*(T_a[:, :2] - T[:2]).T)
        i = int(np.argmin(away + TURN_COST_M * np.abs(se2.wrap(T_a[:, 2] - T[2]))))
        if away[i] <= FAR_MOST_M:
            near += 1
            assert (nearest[j], away_m[j]) == (i, pytest.approx(away[i]))
        else:
            assert away_m[j] > FAR_MOST_M
    assert near > 100
    opposed = np.array([[0.9 * FAR_MOST_M, 0.0, np.pi]])
    assert nearest_keys(np.zeros((1, 3)), opposed, TURN_COST_M, FAR_MOST_M)[1].tolist() == [opposed[0, 0]]


def trail(places: list[tuple[float, float]]) -> Trail:
    """Return a way with a keyframe at each of these places."""
    return Trail(np.column_stack([np.array(places), np.zeros(len(places))]), scans(len(places)))


def along(y: float, length_m: float = 20.0) -> list[tuple[float, float]]:
    return [(x, y) for x in np.arange(0.0, length_m + 0.1, 0.5)]


A = trail(along(0.0))


def compared(b: Trail, believed: tuple[KeyMatch, ...] = (), found: tuple[tuple[int, int], ...] = ()) -> list[Candidate]:
    return candidates((A, b), (A.T_map_key, b.T_map_key), found, believed)


def matched(k: int) -> KeyMatch:
    return KeyMatch(k, k, np.zeros(3), np.eye(3))


def test_a_keyframe_every_few_metres_is_compared_with_the_nearest_of_the_other_way() -> None:
    chosen = compared(trail(along(1.0)))
    assert [one.j for one in chosen] == [one.i for one in chosen] == list(range(0, 41, round(COMPARED_EVERY_M / 0.5)))
    for one in chosen:
        assert one.lost_m == FIRST_LOST_M
        np.testing.assert_allclose(one.T_i_j, [0.0, 1.0, 0.0])


def test_what_is_farther_than_any_scan_may_be_off_is_not_compared() -> None:
    first_m = within_m(FIRST_LOST_M)
    assert first_m < FAR_MOST_M
    assert compared(trail(along(first_m - 0.1))) and not compared(trail(along(first_m + 0.1)))
    assert not compared(trail(along(FAR_MOST_M + 0.5)))
    corner = [*along(1.0, 5.0), *[(5.0, y) for y in np.arange(2.0, 30.0, 0.5)]]  # its box touches the other's
    assert {one.j for one in compared(trail(corner))} == {0, 5, 10}


@pytest.mark.parametrize("k", [3, 4])  # the first keyframe to compare is the 15th or 16th
def test_the_nearer_a_match_that_is_believed_the_nearer_keyframes_must_be(k: int) -> None:
    y = within_m(12.0)
    b = trail(along(y))
    chosen = compared(b, believed=(matched(k),))
    away_m = 2.0 * abs(np.arange(41) - k) * 0.5  # along both ways
    assert chosen and all(one.lost_m == pytest.approx(away_m[one.j], abs=1e-3) for one in chosen)
    assert all(within_m(one.lost_m) >= y for one in chosen)
    assert any(within_m(lost_m) < y for lost_m in away_m)
    assert [one.j for one in chosen] == [
        j for j in range(k + 12, 41, round(COMPARED_EVERY_M / 0.5)) if within_m(away_m[j]) >= y
    ]


def test_what_may_have_drifted_is_counted_along_both_ways_from_the_nearest_match() -> None:
    believed = KeyMatch(10, 30, np.zeros(3), np.eye(3)), KeyMatch(4, 2, np.zeros(3), np.eye(3))
    chosen = compared(trail(along(1.0)), believed)
    assert len(chosen) == 9
    for one in chosen:
        wanted_m = 0.5 * min(abs(one.i - 10) + abs(one.j - 30), abs(one.i - 4) + abs(one.j - 2))
        assert one.lost_m == pytest.approx(wanted_m, abs=1e-3)


def test_the_expected_pose_is_in_the_first_robots_keyframe() -> None:
    T_a, T_b = (np.column_stack([np.array(along(y)), np.full(41, 0.5 * np.pi)]) for y in (0.0, 1.0))
    chosen = candidates((Trail(T_a, scans(41)), Trail(T_b, scans(41))), (T_a, T_b), [], [])
    assert len(chosen) == 9
    for one in chosen:
        np.testing.assert_allclose(one.T_i_j, [1.0, 0.0, 0.0], atol=1e-9)


def test_the_keyframe_that_looks_the_same_way_is_preferred_to_a_nearer_one() -> None:
    T_a, T_b = np.array([[0.0, 0.0, np.pi], [1.0, 0.0, 0.1]]), np.array([[0.0, 1.0, 0.0]])
    (one,) = candidates((Trail(T_a, scans(2)), Trail(T_b, scans(1))), (T_a, T_b), [], [])
    assert one.i == 1


def test_next_to_what_was_matched_nothing_is_compared_again() -> None:
    b = trail(along(1.0))
    assert [one.j for one in compared(b, found=((10, 11), (30, 33)))] == [0, 5, 15, 20, 25, 30, 40]
    assert not compared(b, found=tuple((k, k) for k in range(0, 41, 2)))


def test_keyframes_without_scans_are_not_compared() -> None:
    b, blank = trail(along(1.0)), KeyScans.blank(1)
    every_other = KeyScans.concatenate(scans(1) if k % 2 else blank for k in range(len(A)))
    half_a, half_b = Trail(A.T_map_key, every_other), Trail(b.T_map_key, every_other)
    to_half = candidates((half_a, b), (A.T_map_key, b.T_map_key), [], [])
    assert [one.j for one in to_half] == [0, 5, 10, 15, 20, 25, 30, 35, 40]
    assert all(one.i % 2 == 1 and abs(one.i - one.j) <= 1 for one in to_half)
    of_half = candidates((A, half_b), (A.T_map_key, b.T_map_key), [], [])
    assert [one.j for one in of_half] == [1, 7, 13, 19, 25, 31, 37]
    nothing = Trail(A.T_map_key, KeyScans.blank(len(A)))
    assert not candidates((nothing, b), (A.T_map_key, b.T_map_key), [], [])
    assert not candidates((A, nothing), (A.T_map_key, A.T_map_key), [], [])
