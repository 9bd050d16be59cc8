"""One robot's map rewritten in the team's lattice, tile by tile; only what changed is rewritten."""

from __future__ import annotations

import hashlib
import math

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.grids.tiled_grid import BLOCK_CELLS, TiledGrid
from mrslam.merge.grids.warp import Warp
from mrslam.spatial import TILE_CELLS, UNKNOWN, se2
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
        self._tiled: TiledGrid | None = None
        self._T_team_map: NDArray[np.float64] = np.full(3, np.nan)
        self._resolution_m = 0.0

    def update(self, tiled: TiledGrid, T_team_map: se2.Transform, resolution_m: float) -> None:
        """Bring the tiles up to date with a map placed at ``T_team_map (3,)``, in cells of ``resolution_m``."""
        same_place = np.array_equal(T_team_map, self._T_team_map) and resolution_m == self._resolution_m
        before = self._tiled if same_place else None
        if before is not None and before is tiled:
            return
        if before is not None and tiled.has_lattice_of(before):
            wanted = _touched(tiled, tiled.changed_blocks(before), T_team_map, resolution_m)
        else:
            wanted = self.tiles.keys() | _touched(tiled, tiled.changed_blocks(None), T_team_map, resolution_m)
        warped = Warp(tiled, T_team_map, resolution_m)
        for index in sorted(wanted):
            cells = warped.square(index[0] * TILE_CELLS, index[1] * TILE_CELLS, TILE_CELLS)
            self.warped += 1
            if (cells == UNKNOWN).all():
                self.tiles.pop(index, None)
                self.versions.pop(index, None)
            else:
                self.tiles[index] = cells
                self.versions[index] = hashlib.blake2b(cells.tobytes(), digest_size=16).digest()
        self._tiled, self._T_team_map, self._resolution_m = tiled, np.array(T_team_map), resolution_m


def _touched(
    tiled: TiledGrid, blocks: NDArray[np.int64], T_team_map: se2.Transform, resolution_m: float
) -> set[TileIndex]:
    """Return the tiles that blocks ``(N, 2)`` of a map can reach, with a margin for walls drawn between cells."""
    corners = blocks[:, None, ::-1] + np.array([[0, 0], [1, 0], [0, 1], [1, 1]])
    corners_m = corners * (BLOCK_CELLS * tiled.resolution_m) + np.asarray(tiled.offset_m)
    points = se2.apply(T_team_map, corners_m) / resolution_m
    margin = 3 + math.ceil(3 * tiled.resolution_m / resolution_m)
    first = ((np.floor(points.min(axis=1)) - margin) // TILE_CELLS).astype(int)
    last = ((np.ceil(points.max(axis=1)) + margin) // TILE_CELLS).astype(int)
    return {
        (i, j)
        for (j0, i0), (j1, i1) in zip(first.tolist(), last.tolist(), strict=True)
        for i in range(i0, i1 + 1)
        for j in range(j0, j1 + 1)
    }
