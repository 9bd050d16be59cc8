"""Which poses of a trajectory and its reference belong together, and at which times of a mission they were."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.sim_driver.evaluate.trajectories import NEAR_NS, errors, in_mission_time, matched

S = 1_000_000_000


def line(stamps_s: list[float], speed_m_s: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
    """Return the poses of a robot that drives along x."""
    stamps_s_ = np.array(stamps_s)
    poses = np.stack([speed_m_s * stamps_s_, 0.0 * stamps_s_, 0.0 * stamps_s_], axis=1)
    return np.rint(S * stamps_s_).astype(np.int64), poses


def test_poses_that_no_reference_is_near_in_time_are_left_out() -> None:
    near_s = 0.99 * NEAR_NS / S
    stamps, ours, theirs = matched(line([1.0, 2.0, 3.0, 4.0]), line([1.0 + near_s, 2.1, 2.9, 4.0 - near_s]))
    assert stamps.tolist() == [S, 4 * S]
    assert ours[:, 0].tolist() == [1.0, 4.0] and theirs[:, 0] == pytest.approx([1.0 + near_s, 4.0 - near_s])


def test_a_reference_need_not_be_in_the_order_of_time() -> None:
    stamps_ns, poses = line([4.0, 1.0, 3.0, 2.0])
    stamps, ours, theirs = matched(line([1.0, 2.0, 3.0, 4.0]), (stamps_ns, poses))
    assert stamps.tolist() == [S, 2 * S, 3 * S, 4 * S]
    assert theirs[:, 0].tolist() == ours[:, 0].tolist() == [1.0, 2.0, 3.0, 4.0]


def test_drift_is_of_poses_one_span_apart_and_not_of_those_across_a_gap() -> None:
    stamps_s = [*np.arange(0.0, 2.1, 0.5), *np.arange(30.0, 32.1, 0.5)]  # no scans for 28 s
    found = errors(line(stamps_s, speed_m_s=1.1), line(stamps_s))
    assert found is not None and found["rpe_rmse_m"] == pytest.approx(0.1)
    sparse_s = [0.0, 7.0, 14.0, 21.0]
    found = errors(line(sparse_s), line(sparse_s))
    assert found is not None and found["poses"] == 4 and found["rpe_rmse_m"] is None


def test_a_robots_stamps_begin_when_it_did_and_wait_while_they_run_backward() -> None:
    stamps_ns = np.array([700, 702, 701, 705]) * S
    assert (in_mission_time(stamps_ns, 40.0) / S).tolist() == [40.0, 42.0, 42.0, 45.0]
    assert in_mission_time(stamps_ns[:0], 40.0).size == 0
