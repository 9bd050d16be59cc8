"""Map files whose image is turned in the map's frame."""

from __future__ import annotations

from pathlib import Path

from mrslam.merge.grids.warp import warp
from mrslam.spatial import OccupancyGrid
from mrslam.spatial.files.map_files import read_turned_map


def read_upright(path: Path | str, key: str = "a", resolution_m: float | None = None) -> OccupancyGrid:
    """Read a map as :func:`mrslam.spatial.read_map`; one whose image is turned is rewritten along its frame's axes."""
    grid, T_map_grid = read_turned_map(path, key, resolution_m)
    return warp(grid, T_map_grid) if T_map_grid.any() else grid
