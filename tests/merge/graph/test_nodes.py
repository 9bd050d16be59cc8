"""What the team graph knows of a map."""

import numpy as np
import pytest

from mrslam.merge.graph.nodes import node_of
from mrslam.spatial import OccupancyGrid, TiledMap


def test_a_map_that_is_longer_than_wide_has_its_known_cells_area_middle_and_diagonal():
    cells = np.full((50, 200), -1, dtype=np.int8)
    cells[10:40, 20:180] = 0  # 16 m along x, 3 m along y
    node = node_of(OccupancyGrid(cells, 0.1, (-2.0, 5.0)))
    assert node.area_m2 == pytest.approx(48.0) and node.diameter_m == pytest.approx(np.hypot(16.0, 3.0))
    assert node.centre_m == pytest.approx([-2.0 + 10.0, 5.0 + 2.5])


def test_of_a_map_in_tiles_the_same_is_known_as_of_one_grid():
    cells = np.full((50, 200), -1, dtype=np.int8)
    cells[10:40, 20:180] = 0
    grid = OccupancyGrid(cells, 0.1, (-2.0, 5.0))
    one, other = node_of(grid), node_of(TiledMap.from_grid(grid))
    assert other.area_m2 == pytest.approx(one.area_m2) and other.diameter_m == pytest.approx(one.diameter_m)
    assert other.centre_m == pytest.approx(one.centre_m)
