"""Which keyframes a saved map keeps: those of the last visit to each place, so that its size follows the floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import KeyScans
from mrslam.spatial.key_scans import SAME_M, VISIT_WAY_M, show
from mrslam.spatial.se2 import Transform


def last_visits(T_map_key: Transform, scans: KeyScans, sessions: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which keyframes ``(K, 3)`` to keep, ``(K,) bool``; ``sessions (K,)`` rises, and the last ones are newest.

    From the newest backward a keyframe is left out where one that was kept of a later visit saw its place, in the same
    directions: a visit of another session, or of the same one after ``VISIT_WAY_M`` of path. So is one without a scan
    where others have some.
    """
    count = len(T_map_key)
    keep = np.zeros(count, dtype=np.bool_)
    if not count:
        return keep
    places, seen = T_map_key[:, :2], scans.directions(T_map_key)
    way_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(places, axis=0).T))])
    by_cell: dict[tuple[int, int], list[int]] = {}
    for k in scans.shown[::-1].tolist() or range(count - 1, -1, -1):
        row, col = (int(value) for value in np.floor(places[k] / SAME_M))
        near = [j for r in (-1, 0, 1) for c in (-1, 0, 1) for j in by_cell.get((row + r, col + c), ())]
        others = np.array(near, dtype=np.int64)
        covers = np.hypot(*(places[others] - places[k]).T) <= SAME_M
        covers &= show(seen[others], seen[k])
        covers &= (sessions[others] != sessions[k]) | (way_m[others] - way_m[k] >= VISIT_WAY_M)
        if not covers.any():
            keep[k] = True
            by_cell.setdefault((row, col), []).append(k)
    return keep
