"""When a robot doubts itself, and when it doubts a teammate."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from spatial import TILE_CELLS, LocalMap

CERTAIN = 0.1
"""Health must pass the threshold by this much before a robot that was lost trusts itself again."""
PLACES_LEAST = 5
"""So many places of a trajectory say something about a map."""
ON_FREE = 0.8
"""Share of the places where a robot says it has been that its own map must know to be free."""


@dataclass
class SelfDoubt:
    """Follows the mapper's health: a robot that may be anywhere keeps what it maps to itself."""

    min_health: float
    give_up_ns: int
    since_ns: int | None = None
    """Since when the robot doubts where it is; None while it does not."""

    def look(self, health: float, now_ns: int) -> str | None:
        """Return "doubtful", "recovered" or "given_up" when that has just become so."""
        if self.since_ns is None:
            if health >= self.min_health:
                return None
            self.since_ns = now_ns
            return "doubtful"
        if health >= self.min_health + CERTAIN:
            self.since_ns = None
            return "recovered"
        if now_ns - self.since_ns >= self.give_up_ns:
            self.since_ns = None
            return "given_up"
        return None


def contradicts_itself(local: LocalMap) -> str | None:
    """Return why a map cannot be what its robot saw: it says to have been where its own map has no free floor.

    A turned or mirrored map with a true trajectory, or random cells, are found out before anything is aligned.
    """
    places = local.keyframes.T_map_base[:, :2]
    if len(places) < PLACES_LEAST:
        return None
    cells = np.floor(places / local.map.resolution_m).astype(np.int64)
    free = 0
    for col, row in cells.tolist():
        tile = local.map.tiles.get((row // TILE_CELLS, col // TILE_CELLS))
        free += tile is not None and 0 <= tile.cells[row % TILE_CELLS, col % TILE_CELLS] < 50
    if free >= ON_FREE * len(places):
        return None
    return f"only {100 * free / len(places):.0f} % of the places where it says it has been are free in its own map"
