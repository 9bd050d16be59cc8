"""Tiles that many maps share: counted references, copied before one of them writes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.hits.drawing import Touched, insert_scan, mark_tiles
from mrslam.spatial.hits.views import Beams, Maps, map_of


class Ledger(NamedTuple):
    """Which tiles of a pool are free, and when each was written to."""

    free: NDArray[np.int32]
    """``(T,)``, a stack of tiles that no map holds."""
    stamps: NDArray[np.int64]
    """``(T,)``, number of the write that changed the tile last."""
    touched: Touched
    """Working space."""


class Progress(NamedTuple):
    """How far a sequence of writes has come; a kernel takes one and returns the next."""

    done: int
    """Number of writes that are done, so the index of the next."""
    free_count: int
    """Tiles on the stack of free ones."""
    needed: int
    """Free tiles that the next write needs, if the sequence stopped for lack of them."""
    stamp: int
    """Stamp of the first write of the sequence; the others take those after it."""
    mark: int
    """Mark of the first write of the sequence; the others take those after it."""


class Scans(NamedTuple):
    """S scans, each in the base frame of its own pose."""

    origins: NDArray[np.float64]
    """``(S, 2)``, where the laser is on the base, metres."""
    points: NDArray[np.float64]
    """``(N, 5)``, points of all scans, one scan after the other, see :mod:`mrslam.spatial.matching.scan_points`."""
    starts: NDArray[np.int64]
    """``(S + 1,)``: scan ``i`` has ``points[starts[i] : starts[i + 1]]``."""


@njit(cache=True, nogil=True)
def own_tiles(
    maps: Maps, index: int, ledger: Ledger, free_count: int, count: int, stamp: int
) -> int:  # pragma: no cover - compiled
    """Give map ``index`` the first ``count`` touched tiles for itself; return the number of free tiles left.

    A tile it lacks comes empty, a shared one is copied; ``count`` tiles must be free. Their stamps become ``stamp``:
    they are about to change.
    """
    pool, refs, table = maps.pool, maps.refs, maps.tables[index]
    rows, cols = ledger.touched.rows, ledger.touched.cols
    for i in range(count):
        old = table[rows[i], cols[i]]
        if old != 0 and refs[old] == 1:
            ledger.stamps[old] = stamp
            continue
        free_count -= 1
        new = ledger.free[free_count]
        if old == 0:
            pool[new, :] = 0
        else:
            pool[new, :] = pool[old, :]
            refs[old] -= 1
        refs[new] = 1
        ledger.stamps[new] = stamp
        table[rows[i], cols[i]] = new
    return free_count


@njit(cache=True, nogil=True)
def own_touched(
    maps: Maps, first: int, ledger: Ledger, beams: Beams, poses: NDArray[np.float64], through: bool, progress: Progress
) -> Progress:  # pragma: no cover - compiled
    """Make map ``first + i`` own what a scan touches from ``poses[i]``, ``(n, 3)``, from ``i = progress.done`` on.

    Stops where tiles run out. ``through`` : whether beams touch what they pass, or only what they hit.
    """
    free_count = progress.free_count
    for i in range(progress.done, poses.shape[0]):
        tiles = map_of(maps, first + i)
        count = mark_tiles(ledger.touched, progress.mark + i, tiles, beams, poses[i], through)
        if free_count < count:
            return Progress(i, free_count, count, progress.stamp, progress.mark)
        free_count = own_tiles(maps, first + i, ledger, free_count, count, progress.stamp + i)
    return Progress(poses.shape[0], free_count, 0, progress.stamp, progress.mark)


@njit(cache=True, nogil=True)
def draw_scans(
    maps: Maps, index: int, ledger: Ledger, scans: Scans, poses: NDArray[np.float64], skip_m: float, progress: Progress
) -> Progress:  # pragma: no cover - compiled
    """Add scans to map ``index``, scan ``i`` taken at ``poses[i]``, ``(S, 3)``, from ``i = progress.done`` on.

    Stops where tiles run out. ``skip_m`` : see :func:`mrslam.spatial.hits.drawing.insert_scan`.
    """
    free_count = progress.free_count
    tiles = map_of(maps, index)
    no_ends = np.empty((0, 2))
    for i in range(progress.done, poses.shape[0]):
        beams = Beams(scans.origins[i], scans.points[scans.starts[i] : scans.starts[i + 1]], no_ends)
        count = mark_tiles(ledger.touched, progress.mark + i, tiles, beams, poses[i], True)
        if free_count < count:
            return Progress(i, free_count, count, progress.stamp, progress.mark)
        free_count = own_tiles(maps, index, ledger, free_count, count, progress.stamp + i)
        insert_scan(tiles, maps.refs, beams, poses[i], skip_m)
    return Progress(poses.shape[0], free_count, 0, progress.stamp, progress.mark)


@njit(cache=True, nogil=True)
def copy_tables(
    tables: NDArray[np.int32],
    refs: NDArray[np.int32],
    free: NDArray[np.int32],
    free_count: int,
    parents: NDArray[np.int64],
    out: NDArray[np.int32],
) -> int:  # pragma: no cover - compiled
    """Write table ``parents[i]`` to ``out[i]``, recount references, and return the number of free tiles afterwards.

    ``tables (maps, rows, cols)``, ``parents (n,)``, ``out (n, rows, cols)``; see :class:`Ledger` for ``free``.
    """
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
