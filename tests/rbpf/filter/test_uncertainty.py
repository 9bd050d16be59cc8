"""How surely keyframes lie to each other."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf import MapperConfig
from mrslam.rbpf.filter.particles import Proposals
from mrslam.rbpf.filter.uncertainty import DRIFT_SHARE, chain_information, map_covariance, turned
from mrslam.rbpf.front_end.motion import ARRIVAL_COLUMNS, chain_cov
from mrslam.rbpf.loops.headings import NO_HEADINGS, Headings
from mrslam.spatial import se2
from mrslam.spatial.pose_graph import Edges


@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_errors_of_matches_to_a_map_add_up_by_a_share(n: int) -> None:
    rng = np.random.default_rng(n)
    x = np.zeros((2000, 400))
    for k in range(n, 400):
        x[:, k] = x[:, k - n : k].mean(axis=1) + rng.standard_normal(2000)
    share = (x[:, -1] - x[:, 200]).var() / 199
    assert share == pytest.approx((2.0 / (n + 1)) ** 2, rel=0.1)
    assert (share > DRIFT_SHARE) == (n < 3)


def test_a_match_holds_a_keyframe_along_its_own_axes() -> None:
    arrivals = np.zeros((1, ARRIVAL_COLUMNS))
    arrivals[0, :3] = 0.6, 0.0, 0.5 * np.pi
    by_match = chain_information(MapperConfig(), arrivals, np.diag([1e6, 1.0, 1e6])[None])[0]
    by_motion = np.linalg.inv(chain_cov(MapperConfig(), arrivals))[0]
    assert by_match[1, 1] == pytest.approx(
        1e6 / DRIFT_SHARE + by_motion[1, 1]
    )  # what is ahead of it was to the left before the turn
    assert by_match[0, 0] == pytest.approx(1.0 / DRIFT_SHARE + by_motion[0, 0], rel=1e-3)


def test_information_of_a_match_is_in_the_keyframes_axes() -> None:
    proposals, heading = Proposals.empty(2), 0.7
    proposals.poses[1] = 3.0, -1.0, heading
    proposals.information[1] = turned(np.diag([4.0, 9.0, 25.0])[None], np.array([heading]))[0]
    assert proposals.agreement(1).information == pytest.approx(np.diag([4.0, 9.0, 25.0]))


def test_walls_hold_the_heading() -> None:
    poses, chain = np.array([[0.0, 0.0, 0.1], [1.0, 0.0, 0.4]]), np.tile(np.diag([1e8, 1e8, 100.0]), (2, 1, 1))
    seen = np.array([0.3 - 0.1, 0.3 - 0.4 + 0.5 * np.pi])  # the same walls, and those square to them
    walls = Headings(np.array([0.3]), np.array([0, 1]), np.zeros(2, np.int64), seen, np.array([0.004, 0.004]))
    alone = map_covariance(poses, chain, Edges.none(), NO_HEADINGS)
    held = map_covariance(poses, chain, Edges.none(), walls)
    assert alone[2, 2] == pytest.approx(0.01, rel=1e-3)
    assert held[2, 2] == pytest.approx(1.0 / (100.0 + 1.0 / 0.008), rel=1e-3)


def test_loops_hold_the_map() -> None:
    poses = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [2.0, 0.0, 1.0]])
    chain = np.tile(np.diag([100.0, 100.0, 1e6]), (3, 1, 1))
    assert map_covariance(poses, chain, Edges.none(), NO_HEADINGS)[0, 0] == pytest.approx(0.02, rel=1e-2)
    loop = Edges(np.array([0]), np.array([2]), se2.between(poses[0], poses[2])[None], 50.0 * np.eye(3)[None])
    assert map_covariance(poses, chain, loop, NO_HEADINGS)[0, 0] == pytest.approx(0.01, rel=1e-2)
    assert not map_covariance(poses[:1], chain[:1], loop, NO_HEADINGS).any()


def test_a_match_holds_a_keyframe_along_where_it_came_to_look_after_any_turn() -> None:
    arrivals = np.zeros((1, ARRIVAL_COLUMNS))
    arrivals[0, :3] = 0.6, 0.0, 0.4
    found = chain_information(MapperConfig(), arrivals, np.diag([1e6, 1.0, 1e6])[None])[0]
    ahead = np.array([np.cos(0.4), np.sin(0.4), 0.0])  # in the axes of the keyframe before
    assert ahead @ found @ ahead == pytest.approx(1e6 / DRIFT_SHARE, rel=0.01)
