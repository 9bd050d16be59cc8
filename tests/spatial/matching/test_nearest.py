"""The nearest surface against a slow, obvious twin."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.matching.nearest import nearest
from tests.rbpf.rooms import seen_room, word_at


def naive_nearest(store: TileStore, x: float, y: float, radius: int) -> float:
    best = math.inf
    for row in range(math.floor(y) - radius, math.floor(y) + radius + 1):
        for col in range(math.floor(x) - radius, math.floor(x) + radius + 1):
            word = word_at(store, row, col)
            hits, visits = word & 0x1F, (word >> 5) & 0x3F
            if hits and hits * 5 >= visits:
                mx, my = (((word >> 11) & 0x3F) + 0.5) / 64, (((word >> 17) & 0x3F) + 0.5) / 64
                best = min(best, (col + mx - x) ** 2 + (row + my - y) ** 2)
    return best


def test_nearest_is_the_nearest_or_within_half_a_cell() -> None:
    store, points = seen_room()
    rng = np.random.default_rng(4)
    found = 0
    for x, y in points[rng.integers(0, len(points), 200), :2] / store.resolution_m + rng.normal(0, 1.0, (200, 2)):
        for radius in (1, 2, 3):
            word, _, _, d2, _ = nearest(store.tiles(0), x, y, 0.0, 0.0, 0.0, radius)
            truth = naive_nearest(store, x, y, radius)
            assert (word == 0) == math.isinf(truth)
            if word != 0:
                found += 1
                assert d2 == pytest.approx(truth) or truth <= d2 < 0.25
    assert found > 200
