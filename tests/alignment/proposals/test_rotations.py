"""The turns that lay walls' directions on each other."""

from __future__ import annotations

import numpy as np

from mrslam.alignment.prepared import prepare
from mrslam.alignment.proposals.rotations import rotations
from mrslam.spatial import OccupancyGrid


def test_walls_without_a_direction_are_turned_without_a_division_by_nothing() -> None:
    cells = np.zeros((1, 60), np.int8)
    cells[0, ::6] = 100
    dots = prepare(OccupancyGrid(cells, 0.05), 0.05)
    with np.errstate(all="raise"):
        found = rotations(dots, dots, 3)
    assert np.isfinite(np.array(found)).all()
