"""Which keyframes a saved map keeps: as many as its walls need, so that its size follows the floor."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import KeyScans, se2
from mrslam.spatial.se2 import Transform
from mrslam.spatial.tiles import distinct

CELL_M = 0.3
"""Side of the squares by which walls are counted, metres: points of one keyframe are up to so far apart on a wall 5 m
away."""
SHOWN_BY = 5
"""A square that so many other keyframes show needs no further one. Measured: a log's second half continues its first
half, thinned by this, with 0.99 to 1.05 times the error (mit-csail, intel, aces; with four 0.99 to 1.07 times)."""
NEEDED = 0.2
"""Share of a keyframe's squares that must need it for it to be kept: furniture and people that went are no wall."""


def needed(T_map_key: Transform, scans: KeyScans) -> NDArray[np.bool_]:
    """Return which keyframes ``(K, 3)`` to keep, ``(K,) bool``, the oldest of them first.

    From the oldest on a keyframe is left out where ``SHOWN_BY`` others that are still there show what it shows. So few
    are kept for any square of wall, however often a robot comes by, and they are the last visits'. One without a scan
    is left out, unless none has any.
    """
    if not scans.shown.size:
        return np.ones(len(T_map_key), dtype=np.bool_)
    squares = [np.unique(part) for part in np.split(_squares(T_map_key, scans), scans.starts[1:-1])]
    shown_by = np.bincount(np.concatenate(squares))
    keep = np.zeros(len(T_map_key), dtype=np.bool_)
    for k in scans.shown:
        keep[k] = np.mean(shown_by[squares[k]] <= SHOWN_BY) > NEEDED
        shown_by[squares[k]] -= not keep[k]
    return keep


def _squares(T_map_key: Transform, scans: KeyScans) -> NDArray[np.int64]:
    """Return the number of the square that each scan point ``(P,)`` lies in, from 0."""
    points_m = se2.apply(np.repeat(T_map_key, np.diff(scans.starts), axis=0), scans.points)
    squares = np.floor(points_m / CELL_M).astype(np.int64)
    return distinct(squares)[1]
