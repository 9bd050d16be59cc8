"""Which keyframes saw nothing new: their scans say of a place what those of earlier visits have said."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import KeyScans
from mrslam.spatial.se2 import Transform

SAME_M = 1.5
"""A keyframe saw the place of another one that is this near, metres: teammates match scans up to 2 m apart, and a robot
that comes by has keyframes every half metre, so that one of those that are kept is near enough."""
VISIT_WAY_M = 12.0
"""Least path between two visits of a place, metres: more than a scan's usual reach indoors."""
SHARED = 0.75
"""Least share of the directions seen by a keyframe that another one saw as well: with a field of view of half a turn
headings may differ by less than 90 degrees, with one of a whole turn by any angle."""
VISITS = 2
"""Visits whose scans are kept."""


def is_known(T_map_key: Transform, scans: KeyScans, T_map_new: Transform, new: KeyScans) -> bool:
    """Return whether ``VISITS`` earlier visits saw what a new keyframe sees.

    ``T_map_key (K, 3)`` : where the keyframes are of ``scans``, which may be blank; ``T_map_new (3,)`` : where the new
    one is, whose scan is ``new``.
    """
    near = np.flatnonzero(np.hypot(*(T_map_key[:, :2] - T_map_new[:2]).T) <= SAME_M)
    near = near[np.diff(scans.starts)[near] > 0]
    if near.size < VISITS:
        return False
    way_m = np.cumsum(np.hypot(*np.diff(np.concatenate([T_map_key[:, :2], T_map_new[None, :2]]), axis=0).T))
    seen = new.directions(T_map_new[None])[0]
    begun_m, visits = way_m[-1], 0
    for k in near[::-1].tolist():
        left_m = way_m[k - 1] if k else 0.0
        if begun_m - left_m < VISIT_WAY_M:
            continue
        if (scans.part(k, k + 1).directions(T_map_key[k : k + 1])[0] & seen).sum() >= SHARED * seen.sum():
            begun_m, visits = left_m, visits + 1
            if visits == VISITS:
                return True
    return False
