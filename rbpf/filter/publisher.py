"""The best particle's map as it is published: five levels with hysteresis, in tiles with revisions.

Shares of hits change a little everywhere with every scan. Quantised with hysteresis, the map changes only where
something was seen, and only that has to be sent.
"""

from __future__ import annotations

from typing import Any

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
NO_STAMPS = (0,) * PER_SIDE**2
"""Stamps of the pool tiles of a published one where there are none."""


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
        self._seen: dict[tuple[int, int], tuple[int, ...]] = {}

    def publish(self, store: TileStore, index: int) -> TiledMap:
        """Return map ``index`` of the store; what did not change keeps its revision."""
        now = store.stamps_by_block(index, PER_SIDE)
        revision = self.revision + 1
        changed = False
        for place in sorted(now.keys() | self.tiles.keys()):
            stamps = now.get(place, NO_STAMPS)
            if self._seen.get(place) == stamps:
                continue
            self._seen[place] = stamps
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
            "tiles": [[*place, tile.revision, tile.cells] for place, tile in self.tiles.items()],
            "seen": [[*place, *stamps] for place, stamps in self._seen.items()],
        }

    def restore(self, state: dict[str, Any]) -> None:
        """Become the publisher that was saved."""
        self.revision = state["revision"]
        self.tiles = {(r, c): Tile(revision, cells) for r, c, revision, cells in state["tiles"]}
        self._seen = {(r, c): tuple(stamps) for r, c, *stamps in state["seen"]}


def _parts(place: tuple[int, int]) -> list[tuple[int, int]]:
    """Return (row, col) of the pool tiles that make up the published tile at ``place``, (row, col), row by row."""
    row, col = place[0] * PER_SIDE, place[1] * PER_SIDE
    return [(row + r, col + c) for r in range(PER_SIDE) for c in range(PER_SIDE)]
