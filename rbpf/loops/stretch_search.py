"""Where the newest stretch of way fits what was seen before, all over the map."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.rbpf.loops.drift import Drift
from mrslam.rbpf.loops.kept_scans import KeptScans
from mrslam.spatial.matching.global_search import LOOKS_MOST, Search, WallGrid, find, wall_grid
from mrslam.spatial.se2 import Transform

STRETCH = 10
"""Keyframes that are looked for together: 6 m of way or more."""
EVERY_POINT = 3
"""One in this number of an old scan's points is drawn: cells are larger than the distance between them."""
POINTS_MOST = 120
"""Points of the newest scans that are used."""
POINTS_LEAST = 40
"""Fewer are not looked for."""
SHARE_LEAST = 0.45
"""Least share of the score of a perfect fit that is worth a closer look."""
LOOKS_UNKNOWN = 20 * LOOKS_MOST
"""Most squares looked at for a robot that may be anywhere: with ``LOOKS_MOST`` the right place was passed over in an
office."""
NOWHERE = Search([], True)


def places_of(
    scans: KeptScans,
    T_map_key: Transform,
    old: NDArray[np.int64],
    drift: Drift,
    count: int,
    other_than: list[Transform],
    centre: Transform | None = None,
    share_least: float = SHARE_LEAST,
    most: int = 1,
) -> Search:
    """Return where the newest ``count`` of the keyframes ``(K, 3)`` fit what the ``old`` ones ``(n,)`` saw best.

    ``drift`` : how far they may be from ``centre (3,)``, which is where the newest is if it is None; ``other_than`` :
    places ``(3,)`` that are left out; ``share_least`` : of a perfect fit's score; ``most`` : places returned.
    """
    newest = T_map_key.shape[0] - 1
    centre = T_map_key[-1] if centre is None else centre
    points = scans.joined(T_map_key, scans.connected(newest - count + 1, newest + 1, newest), newest)
    if points.shape[0] < POINTS_LEAST:
        return NOWHERE
    grid = _walls(scans, T_map_key, old, centre, drift.reach_m + float(np.hypot(*points[:, :2].T).max()))
    if grid is None:
        return NOWHERE
    points = points[:: max(1, points.shape[0] // POINTS_MOST)]
    looks_most = LOOKS_UNKNOWN if drift.is_unknown else LOOKS_MOST
    return find(grid, points, centre, drift.reach_m, drift.turn_rad, share_least, other_than, looks_most, most)


def _walls(
    scans: KeptScans, T_map_key: Transform, old: NDArray[np.int64], centre: Transform, reach_m: float
) -> WallGrid | None:
    """Return what the ``old`` keyframes ``(n,)`` saw, as far as it can be within ``reach_m`` of the centre."""
    kept = old[np.abs(T_map_key[old, :2] - centre[:2]).max(axis=1) <= reach_m]
    seen = [scans.points[int(k)][::EVERY_POINT, :2] for k in kept]
    points = np.concatenate([np.empty((0, 2)), *seen])
    if not len(points):
        return None
    x, y, theta = np.repeat(T_map_key[kept], [len(scan) for scan in seen], axis=0).T
    c, s = np.cos(theta), np.sin(theta)
    placed = [x + c * points[:, 0] - s * points[:, 1], y + s * points[:, 0] + c * points[:, 1]]
    return wall_grid(np.stack(placed, axis=1))
