"""Many maps over one pool of tiles: reference counts, copy on write, windows that grow in any direction."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial.hits.cells import TILE, TILE_WORDS
from mrslam.spatial.hits.drawing import Touched, bounds, insert_hits
from mrslam.spatial.hits.sharing import Ledger, Progress, Scans, copy_tables, draw_scans, own_touched
from mrslam.spatial.hits.views import NO_ENDS, Beams, Maps, Tiles

GROWTH_TILES = 8
"""Spare tiles around the window whenever it has to grow, 13 m at 5 cm: it grows seldom."""


class TileStore:
    """``maps`` maps without bounds over one pool of tiles.

    Kernels that read take :meth:`tiles` or :attr:`maps`. Writers own the tiles first (:meth:`own`), one map after the
    other; then any number of threads may write, each to maps of its own. ``refs``, ``free`` and ``stamps`` are
    described at :class:`Maps` and :class:`Ledger`; ``writes`` counts the writes, and is the newest stamp.
    """

    def __init__(self, maps: int, resolution_m: float, spare_tiles: int = 256) -> None:
        self.resolution_m = resolution_m
        self.pool: NDArray[np.uint32] = np.zeros((spare_tiles, TILE_WORDS), dtype=np.uint32)
        self.refs: NDArray[np.int32] = np.zeros(spare_tiles, dtype=np.int32)
        self.free: NDArray[np.int32] = np.arange(spare_tiles - 1, -1, -1, dtype=np.int32)
        self.stamps: NDArray[np.int64] = np.zeros(spare_tiles, dtype=np.int64)
        self.writes = 0
        self.free_count = spare_tiles - 1  # tile 0 is never handed out
        self.row0 = self.col0 = -GROWTH_TILES
        side = 2 * GROWTH_TILES
        self.tables: NDArray[np.int32] = np.zeros((maps, side, side), dtype=np.int32)
        self._mark = np.zeros((side, side), dtype=np.int32)
        self._marked = 0
        self._rows, self._cols = np.empty(4096, dtype=np.int32), np.empty(4096, dtype=np.int32)

    def tiles(self, index: int) -> Tiles:
        """Return one map as kernels take it, until the window or the pool grows."""
        return Tiles(self.pool, self.tables[index], self.row0, self.col0, self.resolution_m)

    @property
    def maps(self) -> Maps:
        """All maps as kernels take them, until the window or the pool grows."""
        return Maps(self.pool, self.refs, self.tables, self.row0, self.col0, self.resolution_m)

    @property
    def _ledger(self) -> Ledger:
        return Ledger(self.free, self.stamps, Touched(self._mark, self._rows, self._cols))

    @property
    def tiles_used(self) -> int:
        """Number of tiles that hold content."""
        return self.refs.size - 1 - self.free_count

    def stamps_of(self, index: int) -> NDArray[np.int64]:
        """Return the stamps ``(R, C)`` of map ``index``'s pool tiles, from (``row0``, ``col0``) on; 0 where none is.

        A stamp changes whenever its tile does.
        """
        return self.stamps[self.tables[index]]

    def words_at(self, index: int, row: int, col: int) -> NDArray[np.uint32]:
        """Return the ``(1024,)`` cells of map ``index``'s pool tile (row, col), all 0 where there is none."""
        return self.pool[self._tile(index, row, col)]

    def _tile(self, index: int, row: int, col: int) -> int:
        r, c = row - self.row0, col - self.col0
        height, width = self._mark.shape
        return int(self.tables[index, r, c]) if 0 <= r < height and 0 <= c < width else 0

    def cover(self, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> None:
        """Widen the window until it holds the box ``low_m (2,) .. high_m (2,)``, map frame, and a tile around it."""
        height, width = self._mark.shape
        row0, col0, r1, c1 = self._window(low_m, high_m)
        if (row0, col0, r1, c1) == (self.row0, self.col0, self.row0 + height, self.col0 + width):
            return
        tables = np.zeros((self.tables.shape[0], r1 - row0, c1 - col0), dtype=np.int32)
        r, c = self.row0 - row0, self.col0 - col0
        tables[:, r : r + height, c : c + width] = self.tables
        self.tables, self.row0, self.col0 = tables, row0, col0
        self._mark = np.zeros(tables.shape[1:], dtype=np.int32)
        self._marked = 0

    def _window(self, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> tuple[int, int, int, int]:
        """Return first and end rows and columns, (row0, col0, row1, col1), of the window that would hold a box."""
        edge = TILE * self.resolution_m
        c_low, r_low = math.floor(low_m[0] / edge), math.floor(low_m[1] / edge)
        c_high, r_high = math.floor(high_m[0] / edge), math.floor(high_m[1] / edge)
        height, width = self._mark.shape
        r1, c1 = self.row0 + height, self.col0 + width
        return (
            self.row0 if r_low - 1 >= self.row0 else r_low - GROWTH_TILES,
            self.col0 if c_low - 1 >= self.col0 else c_low - GROWTH_TILES,
            r1 if r_high + 1 < r1 else r_high + GROWTH_TILES,
            c1 if c_high + 1 < c1 else c_high + GROWTH_TILES,
        )

    def window_tiles(self, low_m: NDArray[np.float64], high_m: NDArray[np.float64]) -> int:
        """Return how many tiles the window would have, filled or not, after :meth:`cover` of a box."""
        row0, col0, r1, c1 = self._window(low_m, high_m)
        return (r1 - row0) * (c1 - col0)

    def restart(self, centre_m: NDArray[np.float64]) -> None:
        """Empty all maps, and shrink the window to some metres around ``centre_m (2,)``, map frame."""
        for index in range(self.tables.shape[0]):
            self.clear(index)
        edge, side = TILE * self.resolution_m, 2 * GROWTH_TILES
        self.row0, self.col0 = (math.floor(centre_m[k] / edge) - GROWTH_TILES for k in (1, 0))
        self.tables = np.zeros((self.tables.shape[0], side, side), dtype=np.int32)
        self._mark, self._marked = np.zeros((side, side), dtype=np.int32), 0

    def own(self, first: int, beams: Beams, poses: NDArray[np.float64], through: bool) -> None:
        """Make every tile that this scan touches from ``poses[i]``, ``(n, 3)``, map ``first + i``'s own.

        ``through`` : whether beams touch what they pass, or only what they hit.
        """
        self._write_all(
            lambda progress: own_touched(self.maps, first, self._ledger, beams, poses, through, progress),
            poses.shape[0],
        )

    def draw(
        self,
        index: int,
        origins: NDArray[np.float64],
        poses: NDArray[np.float64],
        scans: Sequence[NDArray[Any]],
        skip_m: float,
    ) -> None:
        """Add scans with their beams, each ``(N, 5)`` taken at ``poses (n, 3)`` from ``origins (n, 2)`` on the base.

        ``skip_m`` : see :func:`mrslam.spatial.hits.drawing.insert_scan`.
        """
        starts = np.cumsum([0, *map(len, scans)])
        flat = Scans(origins, np.concatenate(scans, dtype=np.float64), starts)
        self._write_all(
            lambda progress: draw_scans(self.maps, index, self._ledger, flat, poses, skip_m, progress), poses.shape[0]
        )

    def _write_all(self, write: Callable[[Progress], Progress], count: int) -> None:
        """Let ``write`` do ``count`` writes, with more tiles wherever it stops for lack of them."""
        if self._rows.size < self._mark.size:
            self._rows = np.empty(2 * self._mark.size, dtype=np.int32)
            self._cols = np.empty(2 * self._mark.size, dtype=np.int32)
        done, needed = 0, 0
        while done < count:
            self._reserve(needed)
            # The write that ran out of tiles marks them again: under a new number, or none would count as new.
            self._marked += needed > 0
            progress = write(Progress(done, self.free_count, 0, self.writes + 1, self._marked + 1))
            done, self.free_count, needed = progress.done, progress.free_count, progress.needed
        self._marked += count
        self.writes += count

    def add_points(self, index: int, pose: NDArray[np.float64], points: NDArray[np.float64]) -> None:
        """Add the hits only of a scan ``points (N, 5)`` at ``pose (3,)``; the window grows as needed."""
        if points.shape[0] == 0:
            return
        box = bounds(pose, points)
        self.cover(box[0], box[1])
        self.own(index, Beams(pose[:2], points, NO_ENDS), pose[None], False)
        insert_hits(self.tiles(index), pose, points)

    def resample(self, parents: NDArray[np.int64]) -> None:
        """Replace map ``i`` by ``parents[i]``: tables are copied, tiles shared, unused ones freed."""
        out = np.empty((parents.size, *self.tables.shape[1:]), dtype=np.int32)
        self.free_count = copy_tables(self.tables, self.refs, self.free, self.free_count, parents, out)
        self.tables = out
        self._shrink()

    def clear(self, index: int) -> None:
        """Empty map ``index``."""
        used = self.tables[index][self.tables[index] != 0]
        self.refs[used] -= 1
        dead = used[self.refs[used] == 0]
        self.free[self.free_count : self.free_count + dead.size] = dead
        self.free_count += dead.size
        self.tables[index] = 0

    def _reserve(self, count: int) -> None:
        if self.free_count >= count:
            return
        size = self.refs.size
        new = max(count, size // 4, 64)
        # realloc moves pages, not bytes: the pool is never held twice.
        self.pool.resize((size + new, TILE_WORDS), refcheck=False)
        self.refs = np.concatenate([self.refs, np.zeros(new, dtype=np.int32)])
        self.stamps = np.concatenate([self.stamps, np.zeros(new, dtype=np.int64)])
        free = np.empty(size + new, dtype=np.int32)
        free[:new] = np.arange(size + new - 1, size - 1, -1, dtype=np.int32)
        free[new : new + self.free_count] = self.free[: self.free_count]
        self.free, self.free_count = free, self.free_count + new

    def _shrink(self) -> None:
        """Give memory back once most of the pool lies idle."""
        size = self.refs.size
        used = self.tiles_used
        if size < 4096 or used * 3 > size:
            return
        live = np.flatnonzero(self.refs)
        to = np.zeros(size, dtype=np.int32)
        to[live] = np.arange(1, live.size + 1, dtype=np.int32)
        keep = max(2 * used, 256) + 1
        for start in range(0, live.size, 4096):  # ascending, so nothing is overwritten before it moved
            part = live[start : start + 4096]
            self.pool[1 + start : 1 + start + part.size] = self.pool[part]
        refs = np.zeros(keep, dtype=np.int32)
        refs[1 : live.size + 1] = self.refs[live]
        stamps = np.zeros(keep, dtype=np.int64)
        stamps[1 : live.size + 1] = self.stamps[live]
        self.stamps = stamps
        self.tables = to[self.tables]
        self.pool.resize((keep, TILE_WORDS), refcheck=False)
        self.refs = refs
        self.free = np.empty(keep, dtype=np.int32)
        spare = np.arange(keep - 1, live.size, -1, dtype=np.int32)
        self.free[: spare.size] = spare
        self.free_count = spare.size

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed store needs."""
        return {
            "pool": self.pool, "refs": self.refs, "stamps": self.stamps, "free": self.free[: self.free_count],
            "tables": self.tables, "window": [self.row0, self.col0], "writes": self.writes,
        }  # fmt: skip

    def restore(self, state: dict[str, Any]) -> None:
        """Become the store that was saved."""
        self.pool, self.refs, self.stamps, self.tables = (state[k] for k in ("pool", "refs", "stamps", "tables"))
        self.free = np.empty(self.refs.size, dtype=np.int32)
        self.free_count = state["free"].size
        self.free[: self.free_count] = state["free"]
        self.row0, self.col0 = state["window"]
        self.writes = state["writes"]
        self._mark = np.zeros(self.tables.shape[1:], dtype=np.int32)
        self._marked = 0
