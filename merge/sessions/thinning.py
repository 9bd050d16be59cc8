"""Which keyframes a saved map keeps: those of the last visit to each place, so that its size follows the floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.merge.joint.trail import OLD_WAY_M
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

SAME_M = 1.0
"""A keyframe saw the place of another one that is this near, metres: half of what two scans of one place may be apart
to be matched (``mrslam.merge.joint.trail.NEAR_M``), so that what is left out is covered by what stays."""
SAME_RAD = np.pi / 4
"""... and looks the same way within this, radians: of a field of view of half a turn three quarters are shared."""


def last_visits(T_map_key: Transform, sessions: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Return which keyframes ``(K, 3)`` to keep, ``(K,) bool``; ``sessions (K,)`` rises, and the last ones are newest.

    From the newest backward a keyframe is left out where one that was kept of a later visit saw its place: a visit
    of another session, or of the same one after ``OLD_WAY_M`` of path.
    """
    count = len(T_map_key)
    keep = np.zeros(count, dtype=np.bool_)
    if not count:
        return keep
    places = T_map_key[:, :2]
    steps = np.hypot(*np.diff(places, axis=0).T)
    way_m = np.concatenate([[0.0], np.cumsum(steps)])
    by_cell: dict[tuple[int, int], list[int]] = {}
    for k in range(count - 1, -1, -1):
        row, col = (int(value) for value in np.floor(places[k] / SAME_M))
        near = [j for r in (-1, 0, 1) for c in (-1, 0, 1) for j in by_cell.get((row + r, col + c), ())]
        others = np.array(near, dtype=np.int64)
        is_same = np.hypot(*(places[others] - places[k]).T) <= SAME_M
        is_same &= np.abs(se2.wrap(T_map_key[others, 2] - T_map_key[k, 2])) <= SAME_RAD
        is_later = (sessions[others] != sessions[k]) | (way_m[others] - way_m[k] >= OLD_WAY_M)
        if not (is_same & is_later).any():
            keep[k] = True
            by_cell.setdefault((row, col), []).append(k)
    return keep
