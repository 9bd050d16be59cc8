"""What the team graph knows of a map."""

import numpy as np
import pytest

from mrslam.merge.graph.nodes import node_of
from mrslam.spatial import OccupancyGrid


def test_a_map_that_is_longer_than_wide_has_its_known_cells_area_middle_and_diagonal():
    cells = np.full((50, 200), -1, dtype=np.int8)
    cells[10:40, 20:180] = 0  # 16 m along x, 3 m along y
    node = node_of(OccupancyGrid(cells, 0.1, (-2.0, 5.0)))
    assert node.area_m2 == pytest.approx(48.0) and node.diameter_m == pytest.approx(np.hypot(16.0, 3.0))
    assert node.centre_m == pytest.approx([-2.0 + 10.0, 5.0 + 2.5])
