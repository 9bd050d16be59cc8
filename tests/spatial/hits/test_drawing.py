"""Scans drawn into maps."""

from __future__ import annotations

import math

import numpy as np

from mrslam.spatial.hits.cells import hits_of, visits_of
from tests.rbpf.rooms import seen_room, word_at


def test_beams_clear_what_a_slow_walk_along_them_passes() -> None:
    store, points = seen_room()
    res = store.resolution_m
    hit_cells = {(math.floor(y / res), math.floor(x / res)) for x, y in points[:, :2]}
    assert all(hits_of(np.int64(word_at(store, *cell))) > 0 for cell in hit_cells)
    for x, y in points[::7, :2]:
        length = math.hypot(x, y)
        for t in np.arange(0.02, length - 0.2, 0.02):
            cell = math.floor(y * t / length / res), math.floor(x * t / length / res)
            # The slow walk may cut a corner that the exact one takes on the other side.
            assert visits_of(np.int64(word_at(store, *cell))) > 0
    outside = [(row, col) for row in (-200, 200) for col in (-200, 250)]
    assert all(word_at(store, *cell) == 0 for cell in outside)
