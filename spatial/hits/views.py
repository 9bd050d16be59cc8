"""Maps and scans as kernels take them: named values of arrays, which are unpacked before a loop, not in it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray


class Tiles(NamedTuple):
    """One map: a window of tile numbers over a pool of tiles."""

    pool: NDArray[np.uint32]
    """``(T, 1024)``, cells of each tile, see :mod:`mrslam.spatial.hits.cells`; tile 0 is empty and never written to."""
    table: NDArray[np.int32]
    """``(rows, cols)``, the pool's row for each tile of the window, 0 where there is none."""
    row0: int
    """Row of the window's first tile in the map's frame, tiles."""
    col0: int
    """Column of the window's first tile in the map's frame, tiles."""
    resolution_m: float
    """Edge of a cell, metres."""


class Maps(NamedTuple):
    """Several maps with one window over one pool, whose tiles they share."""

    pool: NDArray[np.uint32]
    """``(T, 1024)``."""
    refs: NDArray[np.int32]
    """``(T,)``, by how many maps each tile is held."""
    tables: NDArray[np.int32]
    """``(maps, rows, cols)``, a :attr:`Tiles.table` for each map."""
    row0: int
    """As in :class:`Tiles`."""
    col0: int
    """As in :class:`Tiles`."""
    resolution_m: float
    """Edge of a cell, metres."""


class Beams(NamedTuple):
    """One scan in the base frame, metres."""

    origin: NDArray[np.float64]
    """``(2,)``, where the laser is."""
    points: NDArray[np.float64]
    """``(N, 5)``, see :mod:`mrslam.spatial.matching.scan_points`: where beams hit something."""
    ends: NDArray[np.float64]
    """``(M, 2)``, where beams end that hit nothing but clear the map."""


NO_ENDS = np.empty((0, 2))
"""``Beams.ends`` of a scan whose beams all hit something, or where those that do not are ignored."""


@njit(cache=True, nogil=True)
def map_of(maps: Maps, index: int) -> Tiles:  # pragma: no cover - compiled
    """Return one of several maps."""
    return Tiles(maps.pool, maps.tables[index], maps.row0, maps.col0, maps.resolution_m)
