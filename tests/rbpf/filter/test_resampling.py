from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.rbpf.filter.resampling import effective, normalised, systematic


def naive(weights: np.ndarray, count: int, u: float) -> list[int]:
    cdf = np.cumsum(weights) / np.sum(weights)
    last = int(np.flatnonzero(weights)[-1])
    return [min(int(np.searchsorted(cdf, (k + u) / count, side="right")), last) for k in range(count)]


@settings(deadline=None)  # the first call may compile
@given(st.lists(st.integers(0, 100), min_size=1, max_size=40), st.integers(1, 60), st.floats(0.01, 0.99))
def test_as_the_naive_twin(weights: list[int], count: int, u: float) -> None:
    w = np.array(weights, dtype=float)
    if w.sum() == 0:
        assert systematic(w, count, u).tolist() == [k % w.size for k in range(count)]
        return
    cdf = np.cumsum(w) / w.sum()
    if np.abs((np.arange(count) + u)[:, None] / count - cdf).min() < 1e-9:
        return  # on an edge either neighbour is right
    assert systematic(w, count, u).tolist() == naive(w, count, u)


def test_walk_stops_where_sums_fall_short_of_one() -> None:
    for n in (7, 30, 1000):
        w = np.full(n, 0.999 / n)
        parents = systematic(w, w.size, np.nextafter(1.0, 0.0))
        assert parents.max() <= n - 1 and parents.min() >= 0
    w = np.array([0.3, 0.7, 0.0, 0.0])
    assert set(systematic(w, w.size, np.nextafter(1.0, 0.0)).tolist()) <= {0, 1}


def test_every_particle_lives_in_proportion() -> None:
    w = np.array([0.5, 0.25, 0.125, 0.125])
    counts = np.bincount(systematic(np.repeat(w, 8), 32, 0.3), minlength=32)
    assert (np.abs(counts - 32 * np.repeat(w, 8) / 8) < 1.0).all()


def test_weights_survive_a_long_match() -> None:
    w = normalised(np.array([-1e6, -1e6 - 1.0, -1e9]))
    assert w.sum() == pytest.approx(1.0)
    assert w[0] / w[1] == pytest.approx(np.e)
    assert normalised(np.full(3, -np.inf)).tolist() == [1 / 3] * 3
    assert normalised(np.array([np.nan, 0.0])).tolist() == [0.0, 1.0]
    assert effective(np.full(30, 1 / 30)) == pytest.approx(30.0)
