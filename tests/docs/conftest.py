"""Maps that examples and the documentation's code work on."""

from __future__ import annotations

from pathlib import Path

import pytest

from mrslam.sim_driver.worlds import load_world
from mrslam.spatial import OccupancyGrid, write_map


@pytest.fixture(scope="session")
def halves(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Two overlapping parts of one office floor; b's frame is a's, moved by (3, 2) m."""
    grid = load_world("office").grid
    width = grid.shape[1]
    folder = tmp_path_factory.mktemp("halves")
    a = OccupancyGrid(grid.cells[:, : int(0.75 * width)], grid.resolution_m)
    first = int(0.25 * width)
    b = OccupancyGrid(grid.cells[:, first:], grid.resolution_m, (first * grid.resolution_m - 3.0, -2.0))
    write_map(folder / "a" / "map.yaml", a)
    write_map(folder / "b" / "map.yaml", b)
    return folder / "a" / "map.yaml", folder / "b" / "map.yaml"
