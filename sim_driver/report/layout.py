"""Where everything is drawn: one plane for the merged maps, and beside it the maps of robots nobody could place."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.spatial import UNKNOWN, OccupancyGrid, se2
from mrslam.spatial.se2 import Transform

MOST_PIXELS = 900
"""Longest side of the picture, pixels."""
GAP_M = 1.5
"""Room between maps that do not hang together, metres."""
NOTHING = np.full((1, 1), UNKNOWN, dtype=np.int8)
NOTHING_M = 0.05
"""A map without a readable file, and its resolution, metres a cell."""


@dataclass(frozen=True, eq=False)
class Layout:
    """The plane of the page's map, ``y`` upward, its origin at the lower left corner of the picture."""

    anchor: str
    """The robot whose team map is shown: the one that placed most."""
    frame: str
    """The robot whose map frame that team map is in: the anchor, or where that is a base station another."""
    T_plane_map: dict[str, Transform]
    """By robot: maps points of its map into the plane, metres."""
    placed: tuple[str, ...]
    """Robots of the anchor's team map."""
    cell_m: float
    cells: NDArray[np.int8]
    """``(H, W)`` 0 unknown, 1 free, 2 wall; row = +y."""

    def pixels(self, points_m: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Return rows and columns of points ``(..., 2)`` of the plane; they may lie outside."""
        cells = np.floor(points_m / self.cell_m).astype(np.int64)
        return cells[..., 1], cells[..., 0]


def lay_out(run: RunResults) -> Layout:
    """Return the layout of a run with at least one robot that ended in good order."""
    anchor = max(run.robots, key=lambda robot: (len(run.robots[robot]["placed"]), run.robots[robot]["team_area_m2"]))
    placed = {robot: np.array(T) for robot, T in run.robots[anchor]["placed"].items()}
    apart = [x for x, robot in sorted(run.robots.items()) if x not in placed and robot["mode"] != "central"]
    pieces = [(_shown(run.map(anchor, "team_map")), placed)]
    pieces += [(_shown(run.map(robot)), {robot: np.zeros(3)}) for robot in apart]
    T_plane_map: dict[str, Transform] = {}
    parts: list[tuple[OccupancyGrid, NDArray[np.float64]]] = []
    edge_m = GAP_M / 2
    for grid, robots in pieces:
        shift = np.array([edge_m, GAP_M / 2]) - np.asarray(grid.origin_m)
        parts.append((grid, shift))
        for robot, T in robots.items():
            T_plane_map[robot] = se2.compose(np.array([*shift, 0.0]), T)
        edge_m += grid.shape[1] * grid.resolution_m + GAP_M
    height_m = GAP_M + max(grid.shape[0] * grid.resolution_m for grid, _ in parts)
    finest = min(grid.resolution_m for grid, _ in parts)
    cell_m = max(finest, max(edge_m, height_m) / MOST_PIXELS)
    cells = np.zeros((int(np.ceil(height_m / cell_m)) + 1, int(np.ceil(edge_m / cell_m)) + 1), dtype=np.int8)
    for grid, shift in parts:
        for value, mask in ((1, grid.is_known & ~grid.is_occupied), (2, grid.is_occupied)):
            col, row = np.floor((grid.centres(mask) + shift) / cell_m).astype(np.int64).T
            np.maximum.at(cells, (row, col), value)
    return Layout(anchor, run.robots[anchor].get("frame") or anchor, T_plane_map, tuple(sorted(placed)), cell_m, cells)


def _shown(grid: OccupancyGrid | None) -> OccupancyGrid:
    """Return the known part of a map; a damaged one is shown as a single unknown cell."""
    return OccupancyGrid(NOTHING, NOTHING_M) if grid is None else grid.cropped()
