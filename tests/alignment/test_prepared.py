"""Making maps ready to be aligned."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.alignment.kernels.walls import FREE, OCCUPIED
from mrslam.alignment.prepared import main_part, prepare
from mrslam.spatial import OccupancyGrid


@pytest.mark.parametrize("res", [0.05, 0.07, 0.1, 0.2])
def test_coarser_cells_hold_a_wall_where_any_of_theirs_does_else_free_space(res):
    rng = np.random.default_rng(4)
    grid = OccupancyGrid(rng.choice([-1, 0, 100], (37, 53), p=[0.5, 0.3, 0.2]).astype(np.int8), 0.05)
    side = prepare(grid, res)
    expected = np.zeros(side.state.shape, dtype=np.uint8)
    border = round(-side.x0 / res)
    for value, mask in ((FREE, grid.is_free), (OCCUPIED, grid.is_occupied)):
        for r, c in np.argwhere(mask):
            at = int((r + 0.5) * 0.05 / res) + border, int((c + 0.5) * 0.05 / res) + border
            expected[at] = value
    np.testing.assert_array_equal(side.state, expected)


def test_only_large_parts_that_nothing_joins_are_left_out():
    cells = np.full((100, 200), -1, dtype=np.int8)
    cells[10:90, 10:100] = 0
    cells[40:44, 110:114] = 0  # a scrap
    assert main_part(OccupancyGrid(cells, 0.05)).shape == (100, 200)
    cells[10:90, 120:190] = 0
    kept = main_part(OccupancyGrid(cells, 0.05))
    assert kept.known_area_m2() == pytest.approx(80 * 90 * 0.0025)
    assert kept.origin_m == pytest.approx((0.5, 0.5))
    cells[50, 100:120] = 0  # a corridor joins them
    assert main_part(OccupancyGrid(cells, 0.05)).shape == (100, 200)
