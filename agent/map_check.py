"""Whether a teammate's map can be what its robot saw."""

from __future__ import annotations

import numpy as np

from mrslam.spatial import TILE_CELLS, LocalMap

PLACES_LEAST = 5
"""Keyframes from which a map is checked: fewer may all lie at its edge."""
ON_FREE = 0.8
"""Least share of a robot's own keyframes in free cells of its own map; not all, for teammates leave ghosts there."""


def contradicts_itself(local: LocalMap) -> str | None:
    """Return why a map cannot be what its robot saw (its keyframes lie outside its own free cells), or None.

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
