"""Trajectories of particles against lists that keep every pose of every particle."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf.filter.ancestry import Ancestry

COUNT = 4
"""Particles."""


def restored(ancestry: Ancestry) -> Ancestry:
    """Return what continues from its state."""
    again = Ancestry(COUNT)
    again.restore(ancestry.state())
    return again


def of_all(ancestry: Ancestry) -> NDArray[np.float64]:
    return np.array([ancestry.of(k) for k in range(ancestry.count)])


@pytest.mark.parametrize("seed", range(4))
def test_each_particle_continues_from_its_parents_trajectory(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ancestry, naive = Ancestry(COUNT), np.empty((COUNT, 0, 3))
    for k in range(300):
        poses = rng.normal(size=(COUNT, 3))
        ancestry.make_room(0)
        ancestry.append(poses)
        naive = np.concatenate([naive, poses[:, None]], axis=1)
        if rng.random() < 0.2:
            parents = rng.integers(0, COUNT, COUNT)
            ancestry.inherit(parents)
            naive = naive[parents]
        if rng.random() < 0.02:
            ancestry.replace(naive[2])
            naive = np.repeat(naive[2:3], COUNT, axis=0)
        if rng.random() < 0.05:
            ancestry = restored(ancestry)
        assert ancestry.keys == k + 1 and np.array_equal(of_all(ancestry), naive)
        assert np.array_equal(ancestry.ends, naive[:, -1])


def test_where_there_are_too_many_keyframes_the_older_half_is_what_the_best_particle_has(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("mrslam.rbpf.filter.ancestry.APART_MOST", 12)
    ancestry, poses = Ancestry(COUNT), np.random.default_rng(5).normal(size=(40, COUNT, 3))
    for k in range(40):
        best = k // 6 % COUNT
        before = of_all(ancestry)
        shared = ancestry.keys - ancestry.apart.shape[1]
        ancestry.make_room(best)
        after = of_all(ancestry)
        if ancestry.keys - shared == 12:
            assert np.array_equal(
                after[:, : shared + 6], np.repeat(before[best : best + 1, : shared + 6], COUNT, axis=0)
            )
            assert np.array_equal(after[:, shared + 6 :], before[:, shared + 6 :])
        else:
            assert np.array_equal(after, before)
        ancestry.append(poses[k])
        assert ancestry.apart.shape[1] <= 12 and np.array_equal(ancestry.ends, poses[k])
