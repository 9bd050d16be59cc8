"""The best particle's map as it is published: five levels with hysteresis, in tiles with revisions.

Shares of hits change a little everywhere with every scan. Quantised with hysteresis, the map changes only where
something was seen, and only that has to be sent.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial import TILE_CELLS, Tile, TiledMap
from mrslam.spatial.hits.cells import TILE, hits_of, visits_of
from mrslam.spatial.hits.store import TileStore

LEVELS = np.array([0, 25, 50, 75, 100], dtype=np.int8)
"""Occupancy that a cell can have, per cent."""
EDGES = np.array([0.07, 0.15, 0.25, 0.5])
"""Shares of hits between the levels. A quarter of hits makes a wall: beams that graze it pass through its cells too."""
MARGIN = 0.3
"""A published cell changes its level when the share is past the edge by this part of it."""
PER_SIDE = TILE_CELLS // TILE
"""Pool tiles along the side of a published one."""


class Stamps(NamedTuple):
    """The stamps of a map's pool tiles."""

    row0: int
    col0: int
    """Row and column of the first pool tile in the map's lattice."""
    table: NDArray[np.int64]
    """``(R, C)``, 0 where there is no pool tile."""

    def at(self, row: int, col: int) -> int:
        """Return the stamp of one pool tile."""
        r, c = row - self.row0, col - self.col0
        return int(self.table[r, c]) if 0 <= r < self.table.shape[0] and 0 <= c < self.table.shape[1] else 0

    def places(self, before: Stamps) -> list[tuple[int, int]]:
        """Return (row, col) of the published tiles, in order, with a stamp that differs from ``before``."""
        row0, col0 = min(self.row0, before.row0), min(self.col0, before.col0)
        window = row0, col0, max(self._end(0), before._end(0)), max(self._end(1), before._end(1))
        rows, cols = np.nonzero(self._over(window) != before._over(window))
        return sorted(set(zip(((rows + row0) // PER_SIDE).tolist(), ((cols + col0) // PER_SIDE).tolist(), strict=True)))

    def _end(self, axis: int) -> int:
        return self[axis] + self.table.shape[axis]

    def _over(self, window: tuple[int, int, int, int]) -> NDArray[np.int64]:
        row0, col0, row1, col1 = window
        if window == (self.row0, self.col0, self._end(0), self._end(1)):
            return self.table
        before = self.row0 - row0, self.col0 - col0
        return np.pad(self.table, ((before[0], row1 - self._end(0)), (before[1], col1 - self._end(1))))


NO_STAMPS = Stamps(0, 0, np.zeros((0, 0), dtype=np.int64))


@njit(cache=True, nogil=True)
def quantise(
    words: NDArray[np.uint32],
    edges: NDArray[np.float64],
    margin: float,
    levels: NDArray[np.int8],
    out: NDArray[np.int8],
) -> bool:  # pragma: no cover - compiled
    """Bring ``out (32, 32)``, published before, up to date with ``words (1024,)``; return whether it changed.

    ``levels (L,)`` in per cent, and ``edges (L - 1,)``, the shares of hits between them.
    """
    changed = False
    side = out.shape[0]
    for i in range(words.size):
        r, c = i // side, i % side
        visits = visits_of(words[i])
        old = out[r, c]
        if visits == 0:
            new = -1
        else:
            share = hits_of(words[i]) / visits
            k = 0
            while k < edges.size and share > edges[k]:
                k += 1
            if old >= 0 and levels[k] != old:
                was = 0
                while levels[was] != old:
                    was += 1
                if k > was:
                    k = was if share < edges[was] * (1.0 + margin) else k
                elif share > edges[was - 1] * (1.0 - margin):
                    k = was
            new = levels[k]
        if new != old:
            out[r, c] = new
            changed = True
    return changed


class Publisher:
    """Remembers the tiles published last, and the stamps of the pool tiles that they were made from."""

    def __init__(self) -> None:
        self.tiles: dict[tuple[int, int], Tile] = {}
        self.revision = 0
        self._seen, self._keyframes = NO_STAMPS, 0

    def publish(self, store: TileStore, index: int, keyframes: int) -> TiledMap:
        """Return map ``index`` of the store; what did not change keeps its revision.

        ``keyframes`` : how many there are; more of them are a new revision, whether walls moved or not.
        """
        now, seen = Stamps(store.row0, store.col0, store.stamps_of(index)), self._seen
        self._seen, revision = now, self.revision + 1
        changed, self._keyframes = self._keyframes != keyframes, keyframes
        for place in now.places(seen):
            old = self.tiles.get(place)
            cells = np.full((TILE_CELLS, TILE_CELLS), -1, dtype=np.int8) if old is None else old.cells.copy()
            dirty = False
            for k, part in enumerate(_parts(place)):
                r, c = (k // PER_SIDE) * TILE, (k % PER_SIDE) * TILE
                dirty |= quantise(
                    store.words_at(index, *part), EDGES, MARGIN, LEVELS, cells[r : r + TILE, c : c + TILE]
                )
            if dirty:
                cells.flags.writeable = False
                self.tiles[place] = Tile(revision, cells)
                changed = True
        if changed:
            self.revision = revision
        return TiledMap(store.resolution_m, dict(self.tiles), self.revision)

    def state(self) -> dict[str, Any]:
        """Return everything that a resumed publisher needs."""
        return {
            "revision": self.revision,
            "keyframes": self._keyframes,
            "tiles": [[*place, tile.revision, tile.cells] for place, tile in self.tiles.items()],
            "seen": [
                [*place, *(self._seen.at(*part) for part in _parts(place))] for place in self._seen.places(NO_STAMPS)
            ],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Become the publisher that was saved."""
        self.revision, self._keyframes = state["revision"], state["keyframes"]
        self.tiles = {(r, c): Tile(revision, cells) for r, c, revision, cells in state["tiles"]}
        self._seen = _stamps_of(state["seen"])


def _parts(place: tuple[int, int]) -> list[tuple[int, int]]:
    """Return (row, col) of the pool tiles that make up the published tile at ``place``, (row, col), row by row."""
    row, col = place[0] * PER_SIDE, place[1] * PER_SIDE
    return [(row + r, col + c) for r in range(PER_SIDE) for c in range(PER_SIDE)]


def _stamps_of(rows: list[list[int]]) -> Stamps:
    """Return the stamps of ``[row, col, *stamps of its pool tiles]`` of published tiles."""
    if not rows:
        return NO_STAMPS
    places, stamps = np.array(rows, dtype=np.int64)[:, :2], np.array(rows, dtype=np.int64)[:, 2:]
    first, last = places.min(axis=0), places.max(axis=0)
    blocks = np.zeros((*(last - first + 1), PER_SIDE, PER_SIDE), dtype=np.int64)
    blocks[tuple((places - first).T)] = stamps.reshape(-1, PER_SIDE, PER_SIDE)
    table = blocks.swapaxes(1, 2).reshape(blocks.shape[0] * PER_SIDE, blocks.shape[1] * PER_SIDE)
    return Stamps(int(first[0]) * PER_SIDE, int(first[1]) * PER_SIDE, table)
