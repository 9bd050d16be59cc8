"""Relaxation of a trajectory."""

from __future__ import annotations

import numpy as np

from mrslam.rbpf.loops.graph import Edges, relax
from mrslam.spatial import se2


def test_relaxation_spreads_a_loops_error() -> None:
    steps = np.tile([1.0, 0.0, np.pi / 10], (20, 1))
    truth = [np.zeros(3)]
    for step in steps:
        truth.append(se2.compose(truth[-1], step))
    drifted = [np.zeros(3)]
    for step in steps:
        drifted.append(se2.compose(drifted[-1], step + np.array([0.02, 0.01, 0.01])))
    poses, chain = np.stack(drifted), np.arange(20)
    T = np.concatenate([se2.between(poses[:-1], poses[1:]), [np.zeros(3)]])
    info = np.concatenate([np.tile(np.eye(3) * 100.0, (20, 1, 1)), [np.eye(3) * 1e6]])
    first, second = np.append(chain, 0), np.append(chain + 1, 20)
    robust = np.zeros(21, dtype=bool)
    relaxed = relax(poses, Edges(first, second, T, info, robust))
    assert np.abs(relaxed[-1]).max() < 1e-2
    assert np.hypot(*(relaxed - truth)[:, :2].T).max() < 0.4 * np.hypot(*(poses - truth)[:, :2].T).max()
    robust[-1] = True
    assert np.isfinite(relax(poses, Edges(first, second, T, info, robust))).all()


def test_relaxation_goes_on_until_it_settles() -> None:
    steps = np.tile([1.0, 0.0, np.pi / 10], (20, 1))
    poses = [np.zeros(3)]
    for step in steps:
        poses.append(se2.compose(poses[-1], step + np.array([0.02, 0.01, 0.06])))
    drifted, chain = np.stack(poses), np.arange(20)
    T = np.concatenate([se2.between(drifted[:-1], drifted[1:]), [np.zeros(3)]])
    info = np.concatenate([np.tile(np.eye(3) * 100.0, (20, 1, 1)), [np.eye(3) * 1e6]])
    edges = Edges(np.append(chain, 0), np.append(chain + 1, 20), T, info, np.zeros(21, dtype=bool))
    relaxed = relax(drifted, edges)
    assert np.abs(relaxed - drifted).max() > 0.5
    assert np.abs(relax(relaxed, edges) - relaxed).max() < 1e-3
