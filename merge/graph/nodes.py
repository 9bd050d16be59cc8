"""What the team graph knows of one robot's map: its area and extent."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import OccupancyGrid


@dataclass(frozen=True, kw_only=True, eq=False)
class Node:
    """A robot's map as a node of the team graph."""

    area_m2: float
    """Known area, square metres."""
    centre_m: NDArray[np.float64]
    """``(2,)`` centre of the known cells in the map's frame, metres."""
    diameter_m: float
    """Diagonal of the known cells' bounding box, metres."""


def node_of(grid: OccupancyGrid) -> Node:
    """Return area and extent of a map's known cells."""
    part = grid.cropped()
    size = np.array(part.shape[::-1]) * part.resolution_m
    centre = np.asarray(part.origin_m) + size / 2.0
    return Node(area_m2=part.known_area_m2(), centre_m=centre, diameter_m=float(np.hypot(*size)))
