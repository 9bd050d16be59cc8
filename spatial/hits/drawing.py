"""Scans drawn into maps: which tiles a scan touches, and what its beams leave there."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.hits.cells import MASK, TILE, TILE_BITS, add_hit, add_pass
from mrslam.spatial.hits.views import Beams, Tiles
from mrslam.spatial.traversal import along_axis

SKIP_M = 0.1
"""Beams stop clearing the map this far before the wall that they hit: range noise, two cells at 5 cm."""


class Touched(NamedTuple):
    """The tiles of a window that a scan touches; each is listed once."""

    mark: NDArray[np.int32]
    """``(rows, cols)``, number of the call of :func:`mark_tiles` that listed the tile last."""
    rows: NDArray[np.int32]
    """``(at least rows * cols,)``, row in the window of each tile listed."""
    cols: NDArray[np.int32]
    """``(at least rows * cols,)``, column in the window of each tile listed."""


@njit(cache=True, nogil=True)
def bounds(
    pose: NDArray[np.float64], points: NDArray[np.float64]
) -> NDArray[np.float64]:  # pragma: no cover - compiled
    """Return ``(2, 2)``, least and largest x, y in the map (m) of a scan's ``points (N, 5)`` at ``pose (3,)``."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    out = np.array([[np.inf, np.inf], [-np.inf, -np.inf]])
    for i in range(points.shape[0]):
        x = pose[0] + c * points[i, 0] - s * points[i, 1]
        y = pose[1] + s * points[i, 0] + c * points[i, 1]
        out[0, 0], out[0, 1] = min(out[0, 0], x), min(out[0, 1], y)
        out[1, 0], out[1, 1] = max(out[1, 0], x), max(out[1, 1], y)
    return out


@njit(cache=True, nogil=True)
def _hit(
    pool: NDArray[np.uint32], tile: int, x: float, y: float, point: NDArray[np.float64], c: float, s: float
) -> None:  # pragma: no cover - compiled
    """Add a hit at ``(x, y)``, cells, map frame, to a tile; the normal is that of ``point (5,)`` turned by ``c, s``."""
    col, row = int(math.floor(x)), int(math.floor(y))
    k = ((row & MASK) << TILE_BITS) | (col & MASK)
    nx = c * point[2] - s * point[3]
    ny = s * point[2] + c * point[3]
    pool[tile, k] = add_hit(np.int64(pool[tile, k]), x - col, y - row, nx, ny, point[4])


@njit(cache=True, nogil=True)
def insert_hits(
    tiles: Tiles, pose: NDArray[np.float64], points: NDArray[np.float64]
) -> None:  # pragma: no cover - compiled
    """Add the points ``(N, 5)`` of a scan taken at ``pose (3,)`` as hits; the map must own the tiles."""
    c, s = math.cos(pose[2]), math.sin(pose[2])
    inv = 1.0 / tiles.resolution_m
    height, width = tiles.table.shape
    for i in range(points.shape[0]):
        x = (pose[0] + c * points[i, 0] - s * points[i, 1]) * inv
        y = (pose[1] + s * points[i, 0] + c * points[i, 1]) * inv
        tr = (int(math.floor(y)) >> TILE_BITS) - tiles.row0
        tc = (int(math.floor(x)) >> TILE_BITS) - tiles.col0
        if 0 <= tr < height and 0 <= tc < width and tiles.table[tr, tc] != 0:
            _hit(tiles.pool, tiles.table[tr, tc], x, y, points[i], c, s)


@njit(cache=True, nogil=True)
def insert_scan(
    tiles: Tiles, refs: NDArray[np.int32], beams: Beams, pose: NDArray[np.float64], skip_m: float
) -> None:  # pragma: no cover - compiled
    """Add one scan taken at ``pose (3,)``: beams pass from the laser to the points, which are hit.

    Beams stop clearing ``skip_m`` before the point they hit, so that those along a wall do not wear it away. Tiles that
    are missing or, by ``refs (T,)``, shared are left alone: prepare them first.
    """
    origin, points, ends = beams
    c, s = math.cos(pose[2]), math.sin(pose[2])
    inv = 1.0 / tiles.resolution_m
    height, width = tiles.table.shape
    x0 = (pose[0] + c * origin[0] - s * origin[1]) * inv
    y0 = (pose[1] + s * origin[0] + c * origin[1]) * inv
    n = points.shape[0]
    for i in range(n + ends.shape[0]):
        if i < n:
            px, py = points[i, 0], points[i, 1]
        else:
            px, py = ends[i - n, 0], ends[i - n, 1]
        x1 = (pose[0] + c * px - s * py) * inv
        y1 = (pose[1] + s * px + c * py) * inv
        dx, dy = x1 - x0, y1 - y0
        length = math.sqrt(dx * dx + dy * dy)
        keep = 1.0
        if i < n:
            keep = 1.0 - skip_m * inv / max(length, 1e-9)
        if keep > 0.0:
            _pass(tiles, refs, x0, y0, dx * keep, dy * keep)
        if i < n:
            tr = (int(math.floor(y1)) >> TILE_BITS) - tiles.row0
            tc = (int(math.floor(x1)) >> TILE_BITS) - tiles.col0
            if 0 <= tr < height and 0 <= tc < width:
                tile = tiles.table[tr, tc]
                if tile != 0 and refs[tile] == 1:
                    _hit(tiles.pool, tile, x1, y1, points[i], c, s)


@njit(cache=True, nogil=True)
def _pass(
    tiles: Tiles, refs: NDArray[np.int32], x0: float, y0: float, dx: float, dy: float
) -> None:  # pragma: no cover - compiled
    """Count a pass in every cell from ``(x0, y0)`` to ``(x0 + dx, y0 + dy)``, cells, in tiles that the map owns."""
    pool, table, row0, col0, _ = tiles
    height, width = table.shape
    col, row = int(math.floor(x0)), int(math.floor(y0))
    col_end, row_end = int(math.floor(x0 + dx)), int(math.floor(y0 + dy))
    step_col, t_col, dt_col = along_axis(x0, dx, col)
    step_row, t_row, dt_row = along_axis(y0, dy, row)
    tile_r, tile_c, tile = -1 << 30, -1 << 30, 0
    for _ in range(abs(col_end - col) + abs(row_end - row) + 1):
        tr, tc = row >> TILE_BITS, col >> TILE_BITS
        if tr != tile_r or tc != tile_c:
            tile_r, tile_c = tr, tc
            tile = 0
            if 0 <= tr - row0 < height and 0 <= tc - col0 < width:
                tile = table[tr - row0, tc - col0]
                if refs[tile] != 1:
                    tile = 0
        if tile != 0:
            k = ((row & MASK) << TILE_BITS) | (col & MASK)
            pool[tile, k] = add_pass(np.int64(pool[tile, k]))
        if t_col <= t_row:
            col += step_col
            t_col += dt_col
        else:
            row += step_row
            t_row += dt_row


@njit(cache=True, nogil=True)
def mark_tiles(
    touched: Touched, number: int, tiles: Tiles, beams: Beams, pose: NDArray[np.float64], through: bool
) -> int:  # pragma: no cover - compiled
    """List in ``touched`` the tiles that a scan at ``pose (3,)`` touches, and return how many.

    ``through`` : whether beams touch what they pass, or only where they end. ``number`` must differ from those of the
    calls before.
    """
    mark, rows, cols = touched
    row0, col0 = tiles.row0, tiles.col0
    origin, points, ends = beams
    c, s = math.cos(pose[2]), math.sin(pose[2])
    inv = 1.0 / (tiles.resolution_m * TILE)
    height, width = mark.shape
    ox = (pose[0] + c * origin[0] - s * origin[1]) * inv
    oy = (pose[1] + s * origin[0] + c * origin[1]) * inv
    n = points.shape[0]
    count = 0
    for i in range(n + ends.shape[0]):
        if i < n:
            px, py = points[i, 0], points[i, 1]
        else:
            px, py = ends[i - n, 0], ends[i - n, 1]
        x1 = (pose[0] + c * px - s * py) * inv
        y1 = (pose[1] + s * px + c * py) * inv
        x0, y0 = (ox, oy) if through else (x1, y1)
        col, row = int(math.floor(x0)), int(math.floor(y0))
        steps = abs(int(math.floor(x1)) - col) + abs(int(math.floor(y1)) - row) + 1
        step_col, t_col, dt_col = along_axis(x0, x1 - x0, col)
        step_row, t_row, dt_row = along_axis(y0, y1 - y0, row)
        for _ in range(steps):
            tr, tc = row - row0, col - col0
            if 0 <= tr < height and 0 <= tc < width and mark[tr, tc] != number and count < rows.size:
                mark[tr, tc] = number
                rows[count] = tr
                cols[count] = tc
                count += 1
            if t_col <= t_row:
                col += step_col
                t_col += dt_col
            else:
                row += step_row
                t_row += dt_row
    return count
