"""Carpin's acceptance index."""

from __future__ import annotations

import numpy as np

from mrslam.spatial import OccupancyGrid


def test_acceptance_index_of_a_map_with_itself(pair):
    from mrslam import alignment

    a = pair[0]
    assert alignment.acceptance_index(a, a, np.zeros(3)) == 1.0
    assert alignment.acceptance_index(a, a, np.array([0.5, 0.0, 0.0])) < 0.98
    assert alignment.acceptance_index(a, a, np.array([500.0, 0.0, 0.0])) == 0.0
    empty = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    assert alignment.acceptance_index(a, empty, np.zeros(3)) == 0.0


def test_walls_that_agree_count_as_free_space_does():
    from mrslam import alignment

    one, other = np.zeros((10, 10), dtype=np.int8), np.zeros((10, 10), dtype=np.int8)
    one[:4], other[:3] = 100, 100  # 30 cells occupied in both, 10 in one, 60 free in both
    a, b = OccupancyGrid(one, 0.05), OccupancyGrid(other, 0.05)
    assert alignment.acceptance_index(a, b, np.zeros(3)) == 0.9
