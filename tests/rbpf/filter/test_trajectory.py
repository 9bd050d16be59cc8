"""Poses of scans between keyframes."""

from __future__ import annotations

import numpy as np

from mrslam.rbpf.filter.trajectory import spread
from mrslam.rbpf.front_end.motion import ARRIVAL_COLUMNS, CARRIED, MOTION, WAY


def test_scans_between_keyframes_join_both() -> None:
    T_key = np.array([[0.0, 0.0, 0.0], [1.2, 0.1, 0.0]])
    key = np.array([0, 0, 0, 1])
    motion = np.array([[0.0, 0, 0], [0.5, 0, 0], [0.999999, 0, 0], [0, 0, 0]])
    way = np.array([0.0, 0.5, 0.999999, 0.0])
    arrival = np.zeros((2, ARRIVAL_COLUMNS))
    arrival[1, MOTION], arrival[1, WAY] = [1.0, 0, 0], 1.0
    poses = spread(T_key, key, motion, way, arrival)
    assert np.allclose(poses[0], T_key[0]) and np.allclose(poses[3], T_key[1])
    assert np.allclose(poses[1, :2], [0.6, 0.05]) and np.allclose(poses[2], T_key[1], atol=1e-4)


def test_scans_before_a_robot_was_carried_stay_where_it_was() -> None:
    T_key = np.array([[0.0, 0.0, 0.0], [20.0, 7.0, 1.5]])
    motion = np.array([[0.0, 0, 0], [0.2, 0, 0], [0.4, 0, 0]])
    arrival = np.zeros((2, ARRIVAL_COLUMNS))
    arrival[1, MOTION], arrival[1, WAY], arrival[1, CARRIED] = [0.5, 0, 0], 0.5, 1.0
    poses = spread(T_key, np.zeros(3, dtype=np.int64), motion, motion[:, 0], arrival)
    assert np.array_equal(poses, motion)
