"""Tiles that many maps share: counted references, copied before one of them writes."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.rbpf.tiles.drawing import insert_scan, mark_tiles


@njit(cache=True, nogil=True)
def own_tiles(
    pool: NDArray[np.uint32],
    refs: NDArray[np.int32],
    free: NDArray[np.int32],
    free_count: int,
    table: NDArray[np.int32],
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
    count: int,
    stamps: NDArray[np.int64],
    stamp: int,
) -> int:  # pragma: no cover - compiled
    """Make the listed tiles the table's own (new and empty, or copied where shared); return how many are free then.

    ``free`` must hold at least ``count`` tiles. ``stamps[t]`` becomes ``stamp``: the tile is about to change.
    """
    for i in range(count):
        old = table[rows[i], cols[i]]
        if old != 0 and refs[old] == 1:
            stamps[old] = stamp
            continue
        free_count -= 1
        new = free[free_count]
        if old == 0:
            pool[new, :] = 0
        else:
            pool[new, :] = pool[old, :]
            refs[old] -= 1
        refs[new] = 1
        stamps[new] = stamp
        table[rows[i], cols[i]] = new
    return free_count


@njit(cache=True, nogil=True)
def own_touched(
    pool: NDArray[np.uint32],
    refs: NDArray[np.int32],
    free: NDArray[np.int32],
    free_count: int,
    tables: NDArray[np.int32],
    stamps: NDArray[np.int64],
    stamp: int,
    mark: NDArray[np.int32],
    marked: int,
    row0: int,
    col0: int,
    resolution_m: float,
    origin: NDArray[np.float64],
    poses: NDArray[np.float64],
    points: NDArray[np.float64],
    ends: NDArray[np.float64],
    through: bool,
    first: int,
    begin: int,
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
) -> tuple[int, int, int]:  # pragma: no cover - compiled
    """Make map ``first + i`` own what the scan touches from pose ``i (N, 3)``, for ``i = begin ..``.

    Stops where tiles run out. Return the ``i`` it came to, how many tiles are free, and how many that one needs.
    ``mark`` holds numbers below ``marked``, ``stamps`` below ``stamp``; each map takes the next of both.
    """
    for i in range(begin, poses.shape[0]):
        count = mark_tiles(
            mark, marked + i, row0, col0, resolution_m, origin, poses[i], points, ends, through, rows, cols
        )
        if free_count < count:
            return i, free_count, count
        free_count = own_tiles(pool, refs, free, free_count, tables[first + i], rows, cols, count, stamps, stamp + i)
    return poses.shape[0], free_count, 0


@njit(cache=True, nogil=True)
def draw_scans(
    pool: NDArray[np.uint32],
    refs: NDArray[np.int32],
    free: NDArray[np.int32],
    free_count: int,
    table: NDArray[np.int32],
    stamps: NDArray[np.int64],
    stamp: int,
    mark: NDArray[np.int32],
    marked: int,
    row0: int,
    col0: int,
    resolution_m: float,
    origins: NDArray[np.float64],
    poses: NDArray[np.float64],
    points: NDArray[np.float64],
    starts: NDArray[np.int64],
    ends: NDArray[np.float64],
    skip_m: float,
    begin: int,
    rows: NDArray[np.int32],
    cols: NDArray[np.int32],
) -> tuple[int, int, int]:  # pragma: no cover - compiled
    """Add scans ``i = begin ..`` to one map: ``points[starts[i] : starts[i + 1]]``, taken at ``poses[i]``.

    Stops where tiles run out, and returns and takes the same as :func:`own_touched`.
    """
    for i in range(begin, poses.shape[0]):
        scan = points[starts[i] : starts[i + 1]]
        count = mark_tiles(
            mark, marked + i, row0, col0, resolution_m, origins[i], poses[i], scan, ends, True, rows, cols
        )
        if free_count < count:
            return i, free_count, count
        free_count = own_tiles(pool, refs, free, free_count, table, rows, cols, count, stamps, stamp + i)
        insert_scan(pool, refs, table, row0, col0, resolution_m, origins[i], poses[i], scan, ends, skip_m)
    return poses.shape[0], free_count, 0


@njit(cache=True, nogil=True)
def copy_tables(
    tables: NDArray[np.int32],
    refs: NDArray[np.int32],
    free: NDArray[np.int32],
    free_count: int,
    parents: NDArray[np.int64],
    out: NDArray[np.int32],
) -> int:  # pragma: no cover - compiled
    """Write table ``parents[i]`` to ``out[i]``, recount references, and return how many tiles are free then."""
    maps, height, width = tables.shape
    for i in range(parents.size):
        for r in range(height):
            for c in range(width):
                t = tables[parents[i], r, c]
                out[i, r, c] = t
                if t != 0:
                    refs[t] += 1
    for i in range(maps):
        for r in range(height):
            for c in range(width):
                t = tables[i, r, c]
                if t != 0:
                    refs[t] -= 1
                    if refs[t] == 0:
                        free[free_count] = t
                        free_count += 1
    return free_count
