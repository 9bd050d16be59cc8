"""What the team graph knows of one robot's map: its area and extent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import OccupancyGrid, TiledMap


@dataclass(frozen=True, kw_only=True, eq=False)
class Node:
    """A robot's map as a node of the team graph."""

    area_m2: float
    """Known area, square metres."""
    centre_m: NDArray[np.float64]
    """``(2,)`` centre of the known cells in the map's frame, metres."""
    diameter_m: float
    """Diagonal of the known cells' bounding box, metres."""


def node_of(known: OccupancyGrid | TiledMap) -> Node:
    """Return area and extent of a map's known cells."""
    if isinstance(known, TiledMap):
        row0, col0, row1, col1 = known.known_box()
        origin_m, shape = np.array([col0, row0]) * known.resolution_m, (row1 - row0, col1 - col0)
    else:
        part = known.cropped()
        origin_m, shape = np.asarray(part.origin_m), part.shape
    size_m = np.array(shape[::-1]) * known.resolution_m
    return Node(area_m2=known.known_area_m2(), centre_m=origin_m + size_m / 2.0, diameter_m=float(np.hypot(*size_m)))
