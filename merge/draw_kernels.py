"""Kernels that colour the cells of team maps."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray


@njit(cache=True)
def add_layer(
    cells: NDArray[np.int8],
    colour: NDArray[np.float32],
    free_max: int,
    occupied_min: int,
    free: NDArray[np.float32],
    wall: NDArray[np.float32],
) -> None:
    """Add a robot's ``colour (3,)`` and 1 to ``free`` or ``wall (H, W, 4)`` where its ``cells (H, W)`` are."""
    for r in range(cells.shape[0]):
        for c in range(cells.shape[1]):
            value = cells[r, c]
            if 0 <= value <= free_max:
                for k in range(3):
                    free[r, c, k] += colour[k]
                free[r, c, 3] += np.float32(1.0)
            elif value >= occupied_min:
                for k in range(3):
                    wall[r, c, k] += colour[k]
                wall[r, c, 3] += np.float32(1.0)


@njit(cache=True)
def paint(
    cells: NDArray[np.int8],
    free_max: int,
    occupied_min: int,
    free: NDArray[np.float32],
    wall: NDArray[np.float32],
    ink: NDArray[np.float32],
    mixes: NDArray[np.float32],
    picture: NDArray[np.uint8],
) -> None:
    """Colour known ``cells (H, W)`` in ``picture (H, W, 3)`` by the robots that saw them (:func:`add_layer`).

    ``mixes (3, 2)`` : brightness added to, and share of, the robots' mean colour in free cells, in cells that are
    neither, and in walls; walls that no robot shows are of ``ink (3,)``.
    """
    one = np.float32(1.0)
    for r in range(cells.shape[0]):
        for c in range(cells.shape[1]):
            value = cells[r, c]
            if value < 0:
                continue
            is_wall = value >= occupied_min
            kind = 2 if is_wall else 0 if value <= free_max else 1
            walls, both = max(wall[r, c, 3], one), max(free[r, c, 3] + wall[r, c, 3], one)
            for k in range(3):
                if not is_wall:
                    colour = (free[r, c, k] + wall[r, c, k]) / both
                elif wall[r, c, 3] > 0.0:
                    colour = wall[r, c, k] / walls
                else:
                    colour = ink[k]
                picture[r, c, k] = np.uint8(np.rint(mixes[kind, 0] + mixes[kind, 1] * colour))
