"""Which keyframes of two robots are compared."""

import numpy as np
import pytest

from mrslam.merge.joint.candidate_kernels import nearest_keys
from mrslam.merge.joint.candidates import candidates
from mrslam.merge.joint.trail import Trail
from mrslam.spatial import se2
from mrslam.spatial.key_scans import KeyScans
from mrslam.spatial.matching.places import FAR_MOST_M, NEAR_M, TURN_COST_M


def straight(keys: int = 30) -> Trail:
    poses = np.stack([0.5 * np.arange(keys), np.zeros(keys), np.zeros(keys)], axis=1)
    return Trail(poses, KeyScans.empty())


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


def test_the_nearest_keyframe_is_that_of_the_slow_twin():
    rng = np.random.default_rng(0)
    T_a, T_b = (rng.normal(size=(count, 3)) * [5.0, 5.0, 3.0] for count in (200, 150))
    T_a[:, 2], T_b[:, 2] = se2.wrap(T_a[:, 2]), se2.wrap(T_b[:, 2])
    nearest, away_m = nearest_keys(T_a, T_b, TURN_COST_M)
    for j, T in enumerate(T_b):
        away = np.hypot(*(T_a[:, :2] - T[:2]).T)
        i = int(np.argmin(away + TURN_COST_M * np.abs(se2.wrap(T_a[:, 2] - T[2]))))
        assert (nearest[j], away_m[j]) == (i, pytest.approx(away[i]))
