"""Drawing floor plans in metres."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import OccupancyGrid


class Canvas:
    """A floor that walls are drawn on; coordinates are metres from the lower left corner."""

    def __init__(self, width_m: float, height_m: float, resolution_m: float = 0.05, thickness_m: float = 0.1) -> None:
        """Start with an empty floor inside an outer wall."""
        self.resolution_m, self.thickness_m = resolution_m, thickness_m
        self.cells: NDArray[np.int8] = np.zeros((self._cell(height_m), self._cell(width_m)), dtype=np.int8)
        edge = self._cell(thickness_m)
        for side in (self.cells[:edge], self.cells[-edge:], self.cells[:, :edge], self.cells[:, -edge:]):
            side[:] = 100

    def _cell(self, metres: float) -> int:
        return round(metres / self.resolution_m)

    def box(self, x0: float, y0: float, x1: float, y1: float, value: int = 100) -> Canvas:
        """Fill a rectangle; what lies outside the floor is cut off."""
        rows, cols = (slice(max(self._cell(a), 0), max(self._cell(b), 0)) for a, b in ((y0, y1), (x0, x1)))
        self.cells[rows, cols] = value
        return self

    def wall(self, x0: float, y0: float, x1: float, y1: float) -> Canvas:
        """Draw a wall along a horizontal or vertical line, half its thickness on each side."""
        half = self.thickness_m / 2
        return self.box(min(x0, x1) - half, min(y0, y1) - half, max(x0, x1) + half, max(y0, y1) + half)

    def door(self, x: float, y: float, width_m: float, vertical: bool) -> Canvas:
        """Cut an opening into the wall through (x, y); ``vertical`` is the direction of that wall."""
        half, through = width_m / 2, self.thickness_m / 2 + self.resolution_m
        dx, dy = (through, half) if vertical else (half, through)
        return self.box(x - dx, y - dy, x + dx, y + dy, value=0)

    def disc(self, x: float, y: float, radius_m: float) -> Canvas:
        """Draw a round pillar."""
        rows, cols = np.indices(self.cells.shape)
        gap = np.hypot((cols + 0.5) * self.resolution_m - x, (rows + 0.5) * self.resolution_m - y)
        self.cells[gap <= radius_m] = 100
        return self

    def grid(self) -> OccupancyGrid:
        """Return the plan."""
        return OccupancyGrid(self.cells, self.resolution_m)
