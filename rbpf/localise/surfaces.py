"""The surfaces that a grid's walls are, as the hits that a laser would have left there: kernels."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.matching.axes import eigenvalues, main_axis

FREE_SEEN = 8
"""Visits of a cell that a grid calls free: beams that end there contradict it, and any number above 0 says so."""
WALL_SEEN = 6
"""Hits, and visits, of a cell that a grid calls wall: every beam that came there ended in it."""
STEPS = 64
"""Steps of a mean hit point within its cell, in x and in y: 6 bits."""
DIRECTIONS = 256
"""Directions of a normal: 8 bits."""
FLAT = 0.2
"""A wall has a normal where the variance across the cells around is below this share of that along them."""
ONE_SIDED = 0.2
"""A wall has one free side where the middle of the free cells around lies this share of the way to the farthest of them
on it (0.6 of a wall seen from one side): a thin wall that two rooms share has two."""


@njit(cache=True, nogil=True)
def fill_free(
    cells: NDArray[np.int8], origin: NDArray[np.float64], edge_m: float, free_most: int, low: NDArray[np.int64],
    resolution_m: float, words: NDArray[np.uint32],
) -> None:  # fmt: skip # pragma: no cover - compiled
    """Mark the cells of a lattice, ``words (H, W)``, whose centres a grid ``cells (h, w)`` calls free.

    ``origin (2,)``, ``edge_m`` : of the grid, metres. ``low (2,)`` : column and row of the lattice's first cell of
    ``resolution_m``, counted from the map frame's origin. ``free_most`` : the highest percentage that counts as free.
    """
    height, width = cells.shape
    for r in range(words.shape[0]):
        row = int(math.floor(((low[1] + r + 0.5) * resolution_m - origin[1]) / edge_m))
        if not 0 <= row < height:
            continue
        for c in range(words.shape[1]):
            col = int(math.floor(((low[0] + c + 0.5) * resolution_m - origin[0]) / edge_m))
            if 0 <= col < width and 0 <= cells[row, col] <= free_most:
                words[r, c] = FREE_SEEN << 5


@njit(cache=True, nogil=True)
def find_surfaces(
    cells: NDArray[np.int8], free_most: int, wall_least: int, reach: int, near: int, out: NDArray[np.float64]
) -> int:  # pragma: no cover - compiled
    """Write the surfaces of a grid ``cells (h, w)`` as rows of ``out (N, 5)``, and return how many.

    A row is (x, y, nx, ny, sided) in cells from the grid's corner: a wall cell at the edge of its wall, moved onto the
    line through the edge's cells at most ``reach`` rows and columns away that face the same side; its unit normal,
    zeros where there is no line; and 1 where the normal points to the only side that is free, else 0. What has no free
    cell within ``near`` rows and columns no beam can hit.
    """
    height, width = cells.shape
    facing = np.zeros((height, width, 2))
    is_edge = np.zeros((height, width), dtype=np.bool_)
    for row in range(height):
        for col in range(width):
            if cells[row, col] >= wall_least and _is_edge(cells, row, col, wall_least):
                free, fx, fy = _free_side(cells, row, col, free_most, near)
                is_edge[row, col] = free > 0
                facing[row, col, 0], facing[row, col, 1] = fx, fy
    count = 0
    for row in range(height):
        for col in range(width):
            if is_edge[row, col]:
                x, y, nx, ny, sided = _surface(facing, is_edge, row, col, reach)
                out[count, 0], out[count, 1] = x, y
                out[count, 2], out[count, 3], out[count, 4] = nx, ny, sided
                count += 1
    return count


@njit(cache=True, nogil=True)
def _is_edge(cells: NDArray[np.int8], row: int, col: int, wall_least: int) -> bool:  # pragma: no cover - compiled
    """Return whether one of the four cells beside a cell is no wall."""
    height, width = cells.shape
    if row == 0 or col == 0 or row == height - 1 or col == width - 1:
        return True
    return (
        cells[row - 1, col] < wall_least
        or cells[row + 1, col] < wall_least
        or cells[row, col - 1] < wall_least
        or cells[row, col + 1] < wall_least
    )


@njit(cache=True, nogil=True)
def _free_side(
    cells: NDArray[np.int8], row: int, col: int, free_most: int, near: int
) -> tuple[int, float, float]:  # pragma: no cover - compiled
    """Return how many cells around one are free, and where their middle lies from it, as a share of ``near``."""
    height, width = cells.shape
    free, fx, fy = 0, 0.0, 0.0
    for r in range(max(row - near, 0), min(row + near + 1, height)):
        for c in range(max(col - near, 0), min(col + near + 1, width)):
            if 0 <= cells[r, c] <= free_most:
                free += 1
                fx += c - col
                fy += r - row
    most = max(free * near, 1)
    return free, fx / most, fy / most


@njit(cache=True, nogil=True)
def _surface(
    facing: NDArray[np.float64], is_edge: NDArray[np.bool_], row: int, col: int, reach: int
) -> tuple[float, float, float, float, float]:  # pragma: no cover - compiled
    """Return the surface (x, y, nx, ny, sided) at a wall's edge, see :func:`find_surfaces`.

    ``facing (h, w, 2)`` : where the free cells around each cell of an edge, ``is_edge (h, w)``, lie.
    """
    height, width = is_edge.shape
    fx, fy = facing[row, col, 0], facing[row, col, 1]
    n, sx, sy, sxx, sxy, syy = 0, 0.0, 0.0, 0.0, 0.0, 0.0
    for r in range(max(row - reach, 0), min(row + reach + 1, height)):
        for c in range(max(col - reach, 0), min(col + reach + 1, width)):
            if is_edge[r, c] and fx * facing[r, c, 0] + fy * facing[r, c, 1] >= 0.0:
                dx, dy = c - col, r - row
                n += 1
                sx += dx
                sy += dy
                sxx += dx * dx
                sxy += dx * dy
                syy += dy * dy
    x, y = col + 0.5, row + 0.5
    mx, my = sx / n, sy / n
    xx, xy, yy = sxx / n - mx * mx, sxy / n - mx * my, syy / n - my * my
    least, most = eigenvalues(xx, xy, yy)
    if n < 3 or least > FLAT * most:
        return x, y, 0.0, 0.0, 0.0
    along = main_axis(xx, xy, yy)
    nx, ny = -math.sin(along), math.cos(along)
    off = nx * mx + ny * my
    if abs(off) <= 1.0:
        x, y = x + off * nx, y + off * ny
    side = nx * fx + ny * fy
    if side < 0.0:
        nx, ny = -nx, -ny
    return x, y, nx, ny, 1.0 if abs(side) > ONE_SIDED else 0.0


@njit(cache=True, nogil=True)
def fill_walls(
    surfaces: NDArray[np.float64], low: NDArray[np.int64], resolution_m: float, words: NDArray[np.uint32]
) -> None:  # pragma: no cover - compiled
    """Write ``surfaces (N, 5)``, metres in the map frame, into the lattice that :func:`fill_free` describes.

    Only a normal that points to the free side is written: without one, a wall is seen from either.
    """
    height, width = words.shape
    for k in range(surfaces.shape[0]):
        x, y = surfaces[k, 0] / resolution_m, surfaces[k, 1] / resolution_m
        col, row = int(math.floor(x)), int(math.floor(y))
        r, c = row - low[1], col - low[0]
        if not (0 <= r < height and 0 <= c < width):
            continue
        mx, my = min(int((x - col) * STEPS), STEPS - 1), min(int((y - row) * STEPS), STEPS - 1)
        turn = math.atan2(surfaces[k, 3], surfaces[k, 2]) / (2.0 * math.pi) + 1.0
        direction = int(turn * DIRECTIONS + 0.5) % DIRECTIONS
        known = 1 if surfaces[k, 4] > 0.0 else 0
        word = WALL_SEEN | (WALL_SEEN << 5) | (mx << 11) | (my << 17) | (direction << 23) | (known << 31)
        words[r, c] = word
