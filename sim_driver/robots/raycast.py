"""Casting laser beams through a world: exact on its cells, with leaps over open floor."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

MAX_LEAP = 255
"""Longest leap over open floor, cells."""


def leap_field(clearance_cells: NDArray[np.float32]) -> NDArray[np.uint8]:
    """Return how far one may go from anywhere in a cell in any direction without meeting a wall, in whole cells.

    ``clearance_cells`` : ``(H, W)``, centre to centre of the nearest wall cell; both half diagonals come off it.
    Wall cells are 0, free cells at least 1 (where it is no promise: only a leap of 2 and more is one).
    """
    leap = np.clip(np.floor(clearance_cells - np.sqrt(2.0)), 1, MAX_LEAP).astype(np.uint8)
    leap[clearance_cells == 0] = 0
    return leap


@njit(cache=True, nogil=True)
def _cast_one(
    leap: NDArray[np.uint8], x: float, y: float, angle_rad: float, max_range: float
) -> float:  # pragma: no cover - compiled
    """Return the distance along one beam to the first wall cell's edge, ``inf`` beyond ``max_range``; in cells."""
    height, width = leap.shape
    dx, dy = math.cos(angle_rad), math.sin(angle_rad)
    per_x = 1.0 / dx if dx != 0.0 else math.inf
    per_y = 1.0 / dy if dy != 0.0 else math.inf
    step_col, step_row = (1 if dx > 0.0 else -1), (1 if dy > 0.0 else -1)
    ahead_x, ahead_y = (1 if dx > 0.0 else 0), (1 if dy > 0.0 else 0)
    abs_x, abs_y = abs(per_x), abs(per_y)
    t = 0.0
    col, row = int(math.floor(x)), int(math.floor(y))
    while t < max_range:
        if col < 0 or row < 0 or col >= width or row >= height:  # a start outside of the world sees nothing
            return math.inf
        free = leap[row, col]
        if free == 0:
            return t
        if free > 2:
            t += free
            col, row = int(math.floor(x + t * dx)), int(math.floor(y + t * dy))
            continue
        t_x = (col + ahead_x - x) * per_x if dx != 0.0 else math.inf
        t_y = (row + ahead_y - y) * per_y if dy != 0.0 else math.inf
        # Along an edge between cells rounding may have put the beam on the far side of it: that edge lies behind.
        while t < max_range:
            if t_x < t_y:
                t = max(t, t_x)
                t_x += abs_x
                col += step_col
            else:
                t = max(t, t_y)
                t_y += abs_y
                row += step_row
            if leap[row, col] != 1 and leap[row, col] != 2:
                break
    return math.inf


@njit(cache=True, nogil=True)
def cast(
    leap: NDArray[np.uint8],
    x: float,
    y: float,
    heading_rad: float,
    angle_min_rad: float,
    angle_increment_rad: float,
    max_range: float,
    out: NDArray[np.float32],
) -> None:  # pragma: no cover - compiled
    """Write the distance along each beam to the first wall cell's edge, ``inf`` beyond ``max_range``; all in cells.

    ``leap`` : ``(H, W) uint8`` of :func:`leap_field`, closed by a ring of wall. The start is from the grid's corner.
    Steps from cell to cell (Amanatides and Woo 1987) beside walls, and leaps (sphere tracing) where none is near.
    """
    for i in range(out.size):
        out[i] = _cast_one(leap, x, y, heading_rad + angle_min_rad + i * angle_increment_rad, max_range)


@njit(cache=True, nogil=True)
def cast_discs(
    x: float,
    y: float,
    heading_rad: float,
    angle_min_rad: float,
    angle_increment_rad: float,
    centres: NDArray[np.float64],
    radii: NDArray[np.float64],
    ranges: NDArray[np.float32],
) -> None:  # pragma: no cover - compiled
    """Shorten ``ranges`` in place where a beam meets a disc first; one length unit throughout.

    ``centres`` : ``(N, 2)``; ``radii`` : ``(N,)``. A disc that the laser stands in is not seen.
    """
    for k in range(centres.shape[0]):
        cx, cy, r2 = centres[k, 0] - x, centres[k, 1] - y, radii[k] * radii[k]
        d2 = cx * cx + cy * cy
        if d2 <= r2:
            continue
        for i in range(ranges.size):
            angle = heading_rad + angle_min_rad + i * angle_increment_rad
            along = cx * math.cos(angle) + cy * math.sin(angle)
            chord2 = r2 - (d2 - along * along)
            if along > 0.0 and chord2 >= 0.0:
                distance = along - math.sqrt(chord2)
                if distance < ranges[i]:
                    ranges[i] = distance
