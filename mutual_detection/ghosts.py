"""What was mapped of teammates before anyone knew where they were.

A robot cannot drive through walls: what is drawn as occupied where a body has been is a teammate that stood or passed
there. This needs no scan, only paths: one's own, and those of teammates as they come with their maps.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial import OCCUPIED_MIN, OccupancyGrid

AROUND_M = 0.10
"""A speck is a ghost when all of it lies within the body's radius and so much more of a path: noise, alignment."""
INSIDE_M = 0.05
"""Cells deeper than this in the body's way are ghosts even where they touch a wall."""
LONGEST_STEP_M = 1.5
"""Path points farther apart than this are not joined: nobody knows the way between them."""
GAP_CELLS = 2
"""Cells so near to each other are one speck: what continues a wall is wall, though a beam's width of it is missing."""
NEAR, INSIDE = 1, 2
"""Marks of cells: near a path, and in the body's way."""


def clear_ghosts(
    grid: OccupancyGrid, paths_m: Sequence[NDArray[np.float64]], radius_m: float
) -> tuple[OccupancyGrid, int]:
    """Return the map without ghosts, and how many cells became free.

    ``paths_m`` : for each robot ``(K, 2)`` places it has been, in order, in the map's frame; ``radius_m`` : its body's.
    """
    if grid.cells.size == 0 or not len(paths_m):
        return grid, 0
    marks, found = np.zeros(grid.shape, dtype=np.uint8), np.empty(grid.cells.size, dtype=np.int64)
    count = 0
    disc = _disc(radius_m, grid.resolution_m)
    fresh = _fresh(*disc)
    for path in paths_m:
        path = np.asarray(path, dtype=np.float64).reshape(-1, 2)
        path = path[np.isfinite(path).all(axis=1)]
        cells = (path - np.asarray(grid.origin_m)) / grid.resolution_m
        longest = LONGEST_STEP_M / grid.resolution_m
        count = mark(marks, cells, longest, *disc, *fresh, grid.cells, OCCUPIED_MIN, found, count)
    if not count:
        return grid, 0
    cells = grid.cells.copy()
    cleared = free(cells, marks, OCCUPIED_MIN, GAP_CELLS, found[:count])
    return (OccupancyGrid(cells, grid.resolution_m, grid.origin_m), cleared) if cleared else (grid, 0)


def _disc(radius_m: float, resolution_m: float) -> tuple[NDArray[np.int32], NDArray[np.int32], NDArray[np.uint8]]:
    """Return rows, columns and marks ``(N,)`` of the cells around one that a body stands on."""
    reach = math.ceil((radius_m + AROUND_M) / resolution_m)
    rows, cols = np.mgrid[-reach : reach + 1, -reach : reach + 1].astype(np.int32)
    away_m = np.hypot(rows, cols) * resolution_m
    marks = np.where(away_m <= radius_m - INSIDE_M, INSIDE, NEAR).astype(np.uint8)
    near = away_m <= radius_m + AROUND_M
    return rows[near], cols[near], marks[near]


def _fresh(
    rows: NDArray[np.int32], cols: NDArray[np.int32], marks: NDArray[np.uint8]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Return which cells of a disc one step of a body raises, for the nine steps to a cell beside or the same.

    The cells of step ``(dr, dc)`` are ``cells[ends[k]:ends[k + 1]]`` with ``k = 3 (dr + 1) + dc + 1``.
    """
    reach = int(rows.max()) + 1
    before = np.zeros((2 * reach + 1, 2 * reach + 1), dtype=np.uint8)
    before[rows + reach, cols + reach] = marks
    steps = [(dr, dc) for dr in (-1, 0, 1) for dc in (-1, 0, 1)]
    raised = [np.flatnonzero(marks > before[rows + dr + reach, cols + dc + reach]) for dr, dc in steps]
    return np.concatenate(raised), np.cumsum([0, *(cells.size for cells in raised)])


@njit(cache=True, nogil=True)
def mark(
    marks: NDArray[np.uint8],
    path: NDArray[np.float64],
    longest: float,
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
    disc: NDArray[np.uint8],
    fresh: NDArray[np.int64],
    ends: NDArray[np.int64],
    cells: NDArray[np.int8],
    occupied_min: int,
    found: NDArray[np.int64],
    count: int,
) -> int:  # pragma: no cover - compiled
    """Raise ``marks`` ``(H, W)`` to ``disc`` around every cell that a path ``(K, 2)`` (x, y in cells) passes.

    ``fresh``, ``ends`` : the cells of the disc that a step raises (:func:`_fresh`); a path is many small steps. Marked
    cells that are occupied in ``cells (H, W)`` are added to the ``count`` in ``found (H W,)``; how many there are then
    is returned.
    """
    height, width = marks.shape
    reach = rows.max()  # a body beside the map may reach into it
    last_row, last_col = -3 - reach, -3 - reach  # beside no cell that is marked
    for i in range(path.shape[0]):
        steps, dx, dy = 0, 0.0, 0.0
        if i + 1 < path.shape[0]:
            dx, dy = path[i + 1, 0] - path[i, 0], path[i + 1, 1] - path[i, 1]
            length = math.hypot(dx, dy)
            if length <= longest:
                steps = int(length) + 1
        for k in range(steps + 1):
            share = k / steps if steps > 0 else 0.0
            col = int(math.floor(path[i, 0] + share * dx))
            row = int(math.floor(path[i, 1] + share * dy))
            if row == last_row and col == last_col:
                continue
            if row < -reach or col < -reach or row >= height + reach or col >= width + reach:
                continue
            down, right = row - last_row, col - last_col
            last_row, last_col = row, col
            is_step = -1 <= down <= 1 and -1 <= right <= 1
            step = 3 * (down + 1) + right + 1
            for n in range(ends[step] if is_step else 0, ends[step + 1] if is_step else rows.size):
                j = fresh[n] if is_step else n
                r, c = row + rows[j], col + cols[j]
                if 0 <= r < height and 0 <= c < width and marks[r, c] < disc[j]:
                    if marks[r, c] == 0 and cells[r, c] >= occupied_min:
                        found[count] = r * width + c
                        count += 1
                    marks[r, c] = disc[j]
    return count


@njit(cache=True, nogil=True)
def free(
    cells: NDArray[np.int8], marks: NDArray[np.uint8], occupied_min: int, gap: int, found: NDArray[np.int64]
) -> int:  # pragma: no cover - compiled
    """Free the ghosts in ``cells`` ``(H, W)`` by their marks; return how many cells that were.

    ``found`` : the occupied cells that are marked. A group of occupied cells, each at most ``gap`` rows and columns
    from another, goes where all of it is marked; of other groups only the cells marked ``INSIDE`` do. Only marked cells
    are followed: one beside them that is not says all that the rest of the group could.
    """
    height, width = cells.shape
    seen = np.zeros((height, width), dtype=np.bool_)
    group = np.empty(found.size, dtype=np.int64)
    cleared = 0
    for first in found:
        if seen[first // width, first % width]:
            continue
        seen[first // width, first % width] = True
        group[0] = first
        size, i, all_near = 1, 0, True
        while i < size:
            r, c = group[i] // width, group[i] % width
            i += 1
            for nr in range(max(r - gap, 0), min(r + gap + 1, height)):
                for nc in range(max(c - gap, 0), min(c + gap + 1, width)):
                    if seen[nr, nc] or cells[nr, nc] < occupied_min:
                        continue
                    if marks[nr, nc] == 0:
                        all_near = False
                        continue
                    seen[nr, nc] = True
                    group[size] = nr * width + nc
                    size += 1
        for i in range(size):
            r, c = group[i] // width, group[i] % width
            if all_near or marks[r, c] == INSIDE:
                cells[r, c] = 0
                cleared += 1
    return cleared
