"""Whether a teammate's map can be what its robot saw."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.grids.agreement import count_near
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.spatial import LocalMap, se2

PLACES_LEAST = 5
"""Places from which they are held against a map: fewer may all lie at its edge. The scans always are."""
PLACE_M = 0.25
"""Keyframes this near, metres, are one place: a robot that turns on the spot has many there, and a teammate's ghost may
stand on all of them."""
ON_FREE = 0.8
"""Least share of the places of a robot in free cells of its own map; not all, for teammates leave ghosts there."""
ON_WALLS = 0.8
"""Least share of what its scans hit that its own map shows as wall. Measured: 0.98 and more of intel and mit-csail
while they grow, 0.91 and more with people and teammates about; 0.01 of a map turned by a quarter, up to 0.73 of a
mirrored one in an arena that is much the same mirrored."""
ON_WALLS_KNOWN = 0.7
"""The same of a map that was sound when ``SCANS_MOST`` scans were held against it: it cannot become another one's, and
hedges and leaves show as walls what they show as free the next time. Measured: 0.78 to 0.89 of 1.4 km of a campus."""
NEAR_CELLS = 2.9
"""A hit is on a wall that is this near, cells: the noise of a laser, and of corrections since."""
SCANS_MOST = 50
"""Scans that are held against the map, evenly along the way: bounds the time to a millisecond or two."""


def contradicts_itself(local: LocalMap, before: LocalMap | None = None) -> str | None:
    """Return why a map cannot be what its robot saw, or None; ``before`` : an earlier state of it that was sound.

    Its keyframes lie outside its own free cells, or its scans hit what its own map does not show. A turned or mirrored
    map with a true trajectory, or random cells, are found out before anything is aligned.
    """
    tiled = TiledGrid.of(local.map)
    places, free = _places(local, tiled)
    if places >= PLACES_LEAST and free < ON_FREE:
        return f"only {100 * free:.0f} % of the places where it says it has been are free in its own map"
    seen = _seen(local)
    if not len(seen):
        return None
    seen = seen[tiled.values_at(seen) >= 0]  # what is not told, for teammates have told it, contradicts nothing
    shown = _on_walls(tiled, seen) if len(seen) else 0.0
    is_known = before is not None and len(before.key_scans.shown) >= SCANS_MOST
    if shown < (ON_WALLS_KNOWN if is_known else ON_WALLS):
        return f"only {100 * shown:.0f} % of what its scans hit is wall in its own map"
    return None


def _places(local: LocalMap, tiled: TiledGrid) -> tuple[int, float]:
    """Return at how many places a robot has been, and the share of them where a keyframe lies in a free cell.

    Where some have scans, those without count where the map is told: what its teammates have told it does not.
    """
    way, shown = local.keyframes.T_map_base[:, :2], local.key_scans.shown
    values = tiled.values_at(way)
    counts = (values >= 0) | (not shown.size)
    counts[shown] = True
    way, values = way[counts], values[counts]
    place = np.unique(np.floor(way / PLACE_M), axis=0, return_inverse=True)[1].ravel()
    is_free = np.unique(place[(values >= 0) & (values < 50)])
    count = int(place.max(initial=-1)) + 1
    return count, len(is_free) / max(count, 1)


def _seen(local: LocalMap) -> NDArray[np.float64]:
    """Return ``(N, 2)`` where scans evenly chosen along the way hit something, metres, map frame."""
    scans, poses, with_scan = local.key_scans, local.keyframes.T_map_base, local.key_scans.shown
    chosen = with_scan[np.unique(np.linspace(0, len(with_scan) - 1, min(len(with_scan), SCANS_MOST)).astype(np.int64))]
    hits = [se2.apply(poses[k], scans.of(int(k)).astype(np.float64)) for k in chosen]
    return np.concatenate([np.empty((0, 2)), *hits])


def _on_walls(tiled: TiledGrid, points: NDArray[np.float64]) -> float:
    """Return the share of points ``(N, 2)`` with an occupied cell near."""
    return count_near(tiled, points, NEAR_CELLS * tiled.resolution_m)[0] / len(points)
