"""Which cells of a building changed between two maps of it, and the map as it is now.

Two maps that are laid over each other agree within a few centimetres only, so a wall on the free side of itself is no
change: what is compared is whether there is a wall within ``NEAR_M``.
"""

from __future__ import annotations

from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import UNKNOWN, InputError, OccupancyGrid

NEAR_M = 0.1
"""Walls of two maps that are this near are one wall, metres: two cells of 5 cm, one for the drawing of each map."""


class Changes(NamedTuple):
    """Cells ``(H, W) bool`` that differ between an earlier and a later map on one lattice."""

    appeared: NDArray[np.bool_]
    """Occupied now, free before, and no wall was near."""
    vanished: NDArray[np.bool_]
    """Free now, occupied before, and no wall is near."""


def on_one_lattice(*grids: OccupancyGrid) -> list[OccupancyGrid]:
    """Return maps of one frame, resolution and lattice, all widened to the extent of all of them.

    Raises ``InputError`` where they have not one lattice (:func:`mrslam.merge.warp` makes it).
    """
    resolution_m = grids[0].resolution_m
    if any(abs(grid.resolution_m - resolution_m) > 1e-9 or not grid.on_lattice for grid in grids):
        raise InputError(f"maps must be on one lattice of {resolution_m} m: warp them first")
    shown = [grid for grid in grids if grid.cells.size] or [grids[0]]
    row0, col0 = (min(grid.cell0[axis] for grid in shown) for axis in (0, 1))
    row1, col1 = (max(grid.cell0[axis] + grid.shape[axis] for grid in shown) for axis in (0, 1))
    out = []
    for grid in grids:
        cells = np.full((row1 - row0, col1 - col0), UNKNOWN, dtype=np.int8)
        if grid.cells.size:
            r, c = grid.cell0[0] - row0, grid.cell0[1] - col0
            cells[r : r + grid.shape[0], c : c + grid.shape[1]] = grid.cells
        out.append(OccupancyGrid.at_cell(cells, resolution_m, row0, col0))
    return out


def changes(before: OccupancyGrid, after: OccupancyGrid, near_m: float = NEAR_M) -> Changes:
    """Return what changed between two maps of one extent (:func:`on_one_lattice`).

    Only cells count that both maps have seen: what one of them does not know is no change.
    """
    was_near, is_near = (near_walls(grid, near_m) for grid in (before, after))
    return Changes(
        appeared=after.is_occupied & before.is_free & ~was_near, vanished=before.is_occupied & after.is_free & ~is_near
    )


def later_wins(before: OccupancyGrid, after: OccupancyGrid, near_m: float = NEAR_M) -> OccupancyGrid:
    """Return an earlier map brought up to date by a later one of the same extent.

    What the later map knows replaces what the earlier one had, but for walls: one that both show stays where it
    was, to the cell, and grows no thicker, so that walls neither wander nor flicker from visit to visit.
    """
    was_near, is_near = (near_walls(grid, near_m) for grid in (before, after))
    cells = before.cells.copy()
    is_new_wall = after.is_occupied & ~was_near
    is_new_floor = after.is_free & ~(before.is_occupied & is_near)
    cells[is_new_floor], cells[is_new_wall] = after.cells[is_new_floor], after.cells[is_new_wall]
    return OccupancyGrid(cells, before.resolution_m, before.origin_m)


def near_walls(grid: OccupancyGrid, near_m: float) -> NDArray[np.bool_]:
    """Return ``(H, W)`` cells with a wall no farther than ``near_m``, centre to centre."""
    reach = near_m / grid.resolution_m + 1e-6
    edge = 2 * int(reach) + 1
    away = np.arange(edge) - int(reach)
    disc = (np.hypot(away[:, None], away[None, :]) <= reach).astype(np.uint8)
    if not grid.cells.size:
        return np.zeros(grid.shape, dtype=np.bool_)
    return np.asarray(cv2.dilate(grid.is_occupied.astype(np.uint8), disc) > 0)
