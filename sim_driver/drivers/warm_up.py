"""Compiles this package's kernels ahead of use."""

from __future__ import annotations

import numpy as np

from mrslam.sim_driver.drivers.explore import Explorer
from mrslam.sim_driver.drivers.waypoints import WaypointDriver
from mrslam.spatial import OccupancyGrid


def warm_up() -> None:
    """Call each kernel once."""
    cells = np.full((40, 40), -1, dtype=np.int8)
    cells[8:32, 8:32] = 0
    cells[8, 8:32] = 100
    grid = OccupancyGrid(cells, 0.05, (-1.0, -1.0))
    Explorer().command(0, np.zeros(3), grid, {"other": np.array([0.4, 0.4, 0.0])})
    WaypointDriver([[0.4, 0.4]]).command(0, np.zeros(3), grid, {})
