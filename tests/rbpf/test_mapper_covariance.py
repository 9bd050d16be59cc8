"""What the mapper says of its own error."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrslam.rbpf import Mapper
from mrslam.rbpf.front_end.motion import composed_cov
from mrslam.spatial import se2
from tests.rbpf.rooms import SMALL, drive, feed


def sigma_m(mapper: Mapper) -> float:
    return float(np.sqrt(np.trace(mapper.covariance[:2, :2])))


NO_WALLS = replace(SMALL, use_walls=False)
"""Without it, what is learnt of how parallel the walls are makes the pose surer meanwhile."""


def test_uncertainty_grows_with_the_way_and_shrinks_where_a_loop_closes() -> None:
    poses = drive(150)
    one_way, there_and_back = Mapper(NO_WALLS, seed=1), Mapper(NO_WALLS, seed=1)
    assert not one_way.covariance.any()
    feed(one_way, poses[:40])
    early = sigma_m(one_way)
    feed(one_way, poses[:75], start=40)
    late = sigma_m(one_way)
    assert 0.003 < early < late
    feed(there_and_back, np.concatenate([poses, poses[1:30]]))
    alone = Mapper(replace(NO_WALLS, close_loops=False), seed=1)
    feed(alone, np.concatenate([poses, poses[1:30]]))
    assert sigma_m(there_and_back) < 0.9 * sigma_m(alone)


def test_errors_are_as_large_as_they_are_said_to_be() -> None:
    poses, squared = drive(150), []
    mapper = Mapper(SMALL, seed=1)
    for k in range(60, 150, 10):
        feed(mapper, poses[:k], start=max(k - 10, 0) if k > 60 else 0)
        error = mapper.T_map_base - poses[k - 1]
        error[2] = se2.wrap(error[2])
        squared.append(error @ np.linalg.solve(mapper.covariance, error))
    assert 0.2 < np.mean(squared) < 6.0  # exact: 3


def test_a_restored_mapper_says_the_same() -> None:
    mapper, again = Mapper(SMALL, seed=1), Mapper(SMALL, seed=1)
    feed(mapper, drive(150)[:60])
    again.restore(mapper.state())
    assert np.array_equal(again.covariance, mapper.covariance)


def test_the_error_of_a_keyframes_heading_turns_what_came_since() -> None:
    rng, key = np.random.default_rng(2), np.array([3.0, -1.0, 0.7])
    since = np.array([1.5, 0.4, 0.3])
    key_cov, motion_cov = np.diag([0.01, 0.04, 0.0025]), np.diag([0.0009, 0.0001, 0.0004])
    keys = key + rng.multivariate_normal(np.zeros(3), key_cov, 20000)
    motions = since + rng.multivariate_normal(np.zeros(3), motion_cov, 20000)
    sampled = np.cov(se2.compose(keys, motions).T)
    found = composed_cov(se2.compose(key, since), since, key_cov, motion_cov)
    assert np.allclose(found, sampled, atol=0.002)
