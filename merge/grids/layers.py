"""One robot's map rewritten in the team's lattice, tile by tile; only what changed is rewritten."""

from __future__ import annotations

import hashlib

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.grids.warp import Warp
from mrslam.spatial import TILE_CELLS, UNKNOWN, OccupancyGrid, se2
from mrslam.spatial.tiles import TileIndex


class Layer:
    """A robot's map as tiles of the team map."""

    def __init__(self) -> None:
        self.tiles: dict[TileIndex, NDArray[np.int8]] = {}
        """``(64, 64) int8`` by tile of the team lattice; all-unknown tiles are left out."""
        self.versions: dict[TileIndex, bytes] = {}
        """Hash of each tile's cells."""
        self.warped = 0
        """Tiles rewritten so far."""
        self._grid: OccupancyGrid | None = None
        self._T_team_map: NDArray[np.float64] = np.full(3, np.nan)
        self._resolution_m = 0.0

    def update(self, grid: OccupancyGrid, T_team_map: se2.Transform, resolution_m: float) -> None:
        """Bring the tiles up to date with a map placed at ``T_team_map (3,)``, in cells of ``resolution_m``."""
        same_place = np.array_equal(T_team_map, self._T_team_map) and resolution_m == self._resolution_m
        before = self._grid if same_place else None
        if before is not None and before is grid:
            return
        wanted = set(self.tiles) if before is None else set[TileIndex]()
        wanted |= _touched(changed_squares(before, grid), T_team_map, resolution_m)
        warped = Warp(grid, T_team_map, resolution_m)
        for index in sorted(wanted):
            cells = warped.square(index[0] * TILE_CELLS, index[1] * TILE_CELLS, TILE_CELLS)
            self.warped += 1
            if (cells == UNKNOWN).all():
                self.tiles.pop(index, None)
                self.versions.pop(index, None)
            else:
                self.tiles[index] = cells
                self.versions[index] = hashlib.blake2b(cells.tobytes(), digest_size=16).digest()
        self._grid, self._T_team_map, self._resolution_m = grid, np.array(T_team_map), resolution_m


def _touched(squares_m: NDArray[np.float64], T_team_map: se2.Transform, resolution_m: float) -> set[TileIndex]:
    """Return the tiles that squares ``(N, 3)`` of a map can reach, with a margin for walls drawn between cells."""
    edge_m = squares_m[:, None, 2:]
    corners_m = squares_m[:, None, :2] + edge_m * np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])
    points = se2.apply(T_team_map, corners_m) / resolution_m
    margin = 3 + np.ceil(3 * edge_m[:, 0] / TILE_CELLS / resolution_m)
    first = ((np.floor(points.min(axis=1)) - margin) // TILE_CELLS).astype(int)
    last = ((np.ceil(points.max(axis=1)) + margin) // TILE_CELLS).astype(int)
    return {
        (i, j)
        for (j0, i0), (j1, i1) in zip(first.tolist(), last.tolist(), strict=True)
        for i in range(i0, i1 + 1)
        for j in range(j0, j1 + 1)
    }


def changed_squares(before: OccupancyGrid | None, after: OccupancyGrid) -> NDArray[np.float64]:
    """Return squares ``(N, 3)`` that hold all cells that differ: x, y of the lower left corner and edge, metres.

    Where the lattices differ, or there is no map before, that is all that is known of either.
    """
    if before is None or same_lattice(before, after):
        return _squares(before, after)
    return np.concatenate([_squares(None, before), _squares(None, after)])


def _squares(before: OccupancyGrid | None, after: OccupancyGrid) -> NDArray[np.float64]:
    """Return the blocks of 64 x 64 cells, as squares, that differ between maps of one lattice."""
    grids = [grid for grid in (before, after) if grid is not None and grid.cells.size]
    if not grids:
        return np.empty((0, 3))
    first = np.min([grid.cell0 for grid in grids], axis=0) // TILE_CELLS
    last = (np.max([np.add(grid.cell0, grid.shape) for grid in grids], axis=0) - 1) // TILE_CELLS
    canvas = [on_canvas(grid, *((last - first + 1) * TILE_CELLS), *(first * TILE_CELLS)) for grid in grids]
    differs = canvas[0] != (canvas[1] if len(canvas) == 2 else UNKNOWN)
    blocks = np.argwhere(any_by_block(differs, TILE_CELLS))
    offset_m = np.asarray(after.origin_m) - np.array(after.cell0[::-1]) * after.resolution_m
    edge_m = TILE_CELLS * after.resolution_m
    corners_m = (blocks + first)[:, ::-1] * edge_m + offset_m
    return np.concatenate([corners_m, np.full((len(blocks), 1), edge_m)], axis=1)


def same_lattice(one: OccupancyGrid, two: OccupancyGrid) -> bool:
    """Return whether two maps have cells of one size that lie on each other."""
    if one.resolution_m != two.resolution_m:
        return False
    shift = (np.asarray(one.origin_m) - np.asarray(two.origin_m)) / one.resolution_m
    return bool(np.all(np.abs(shift - np.round(shift)) < 1e-6))


def any_by_block(mask: NDArray[np.bool_], edge: int) -> NDArray[np.bool_]:
    """Return which blocks of ``edge x edge`` cells have a cell of ``mask (edge R, edge C)``: ``(R, C)``."""
    rows, cols = mask.shape[0] // edge, mask.shape[1] // edge
    by_rows = mask.reshape(rows, edge, cols * edge).any(
        axis=1
    )  # first along what lies side by side in memory: ten times faster
    return np.asarray(by_rows.reshape(rows, cols, edge).any(axis=2))


def on_canvas(grid: OccupancyGrid, height: int, width: int, row0: int, col0: int) -> NDArray[np.int8]:
    """Return a map's cells ``(height, width)`` from the lattice's cell (row0, col0) on; unknown where it has none."""
    canvas = np.full((height, width), UNKNOWN, dtype=np.int8)
    r, c = grid.cell0[0] - row0, grid.cell0[1] - col0
    canvas[r : r + grid.shape[0], c : c + grid.shape[1]] = grid.cells
    return canvas
