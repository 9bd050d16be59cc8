"""Drawing the walls of a rotated grid: walls one cell thick are lines between cell centres, not sampled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OCCUPIED = 65
"""Equals ``mrslam.spatial.OCCUPIED_MIN``."""
LINKS = ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1))
"""(d row, d col) of the eight neighbours; the first four reach each pair of neighbours once."""
DRAWS_THIN = 0.95
"""Target over source resolution above which walls one cell thick are drawn as lines; below, a source cell covers more
than one target cell, and a wall keeps its width in metres. Less than 1, for two equal resolutions may be rounded."""
SAMPLES_ALL = 1.05
"""Target over source resolution up to which sampling the centres meets every source cell, so that an area of wall needs
no drawing. More than 1, for two equal resolutions may be rounded."""


@njit(cache=True, nogil=True)
def is_wall(cells: NDArray[np.int8], r: int, c: int) -> bool:  # pragma: no cover - compiled
    """Return whether a cell is inside the grid and a wall."""
    if r < 0 or r >= cells.shape[0] or c < 0 or c >= cells.shape[1]:
        return False
    return cells[r, c] >= OCCUPIED  # as one expression it takes three times as long: numba counts references to it


@njit(cache=True, nogil=True)
def is_thick(cells: NDArray[np.int8], r: int, c: int) -> bool:  # pragma: no cover - compiled
    """Whether the wall cell is part of a 2 x 2 block of wall."""
    up, down = is_wall(cells, r + 1, c), is_wall(cells, r - 1, c)
    right, left = is_wall(cells, r, c + 1), is_wall(cells, r, c - 1)
    if up and right and is_wall(cells, r + 1, c + 1):
        return True
    if up and left and is_wall(cells, r + 1, c - 1):
        return True
    if down and right and is_wall(cells, r - 1, c + 1):
        return True
    return down and left and is_wall(cells, r - 1, c - 1)


@njit(cache=True, nogil=True)
def _put(out: NDArray[np.int8], row: int, col: int, value: int) -> None:  # pragma: no cover - compiled
    if 0 <= row < out.shape[0] and 0 <= col < out.shape[1] and out[row, col] < value:
        out[row, col] = value


@njit(cache=True, nogil=True)
def _draw_link(
    out: NDArray[np.int8],
    row0: int,
    col0: int,
    start: tuple[float, float, int],
    end: tuple[float, float, int],
    along_u: bool,
) -> None:  # pragma: no cover - compiled
    """Draw the part of a wall between two cell centres: one cell for each cell centre passed along the longer axis.

    Ends are (x, y, value) in cells of the lattice whose (row0, col0) is ``out[0, 0]``; each half has its end's value.
    """
    u0, v0, value0 = start
    u1, v1, value1 = end
    if not along_u:
        u0, v0, u1, v1 = v0, u0, v1, u1
    if u0 > u1:
        u0, v0, u1, v1 = u1, v1, u0, v0
        value0, value1 = value1, value0
    slope = (v1 - v0) / (u1 - u0)
    for step in range(int(math.ceil(u0 - 0.5)), int(math.ceil(u1 - 0.5))):
        gone = step + 0.5 - u0
        other = int(math.floor(v0 + gone * slope))
        value = value0 if gone < 0.5 * (u1 - u0) else value1
        if along_u:
            _put(out, other - row0, step - col0, value)
        else:
            _put(out, step - row0, other - col0, value)


@njit(cache=True, nogil=True)
def _turn(inverse: NDArray[np.float64]) -> tuple[float, float, float, float]:  # pragma: no cover - compiled
    """Return the matrix (xx, xy, yx, yy) that turns and scales source vectors to target ones."""
    det = inverse[0, 0] * inverse[1, 1] - inverse[0, 1] * inverse[1, 0]
    return inverse[1, 1] / det, -inverse[0, 1] / det, -inverse[1, 0] / det, inverse[0, 0] / det


@njit(cache=True, nogil=True)
def _centre(
    inverse: NDArray[np.float64], turn: tuple[float, float, float, float], r: int, c: int
) -> tuple[float, float]:  # pragma: no cover - compiled
    """Return the target point, in cells, of a source cell's centre."""
    x, y = c + 0.5 - inverse[0, 2], r + 0.5 - inverse[1, 2]
    return turn[0] * x + turn[1] * y, turn[2] * x + turn[3] * y


@njit(cache=True, nogil=True)
def is_linked(
    cells: NDArray[np.int8], r: int, c: int, dr: int, dc: int, is_area: bool, draws_thin: bool
) -> bool:  # pragma: no cover - compiled
    """Return whether a line is drawn from a wall cell to its neighbour; ``is_area``: the cell itself is sampled."""
    if not is_wall(cells, r + dr, c + dc):
        return False
    if dr != 0 and dc != 0:  # else joined around the corner
        return not (is_wall(cells, r + dr, c) or is_wall(cells, r, c + dc))
    return not (is_area and (not draws_thin or is_thick(cells, r + dr, c + dc)))  # else joined by the sampling


@njit(cache=True, nogil=True)
def draw_wall(
    cells: NDArray[np.int8], inverse: NDArray[np.float64], ratio: float, r: int, c: int,
    row0: int, col0: int, out: NDArray[np.int8],
) -> None:  # fmt: skip  # pragma: no cover - compiled
    """Draw a wall cell: lines to its neighbours, and itself where no line through it does."""
    draws_thin = ratio > DRAWS_THIN
    is_area = not draws_thin or is_thick(cells, r, c)
    turn = _turn(inverse)
    u, v = _centre(inverse, turn, r, c)
    links, is_passed, last_step, last_along_u = 0, False, 0.0, False
    for k in range(8):
        dr, dc = LINKS[k]
        if not is_linked(cells, r, c, dr, dc, is_area, draws_thin):
            continue
        links += 1
        # By direction alone: rounding must not choose another axis for the next link of a straight wall.
        du, dv = turn[0] * dc + turn[1] * dr, turn[2] * dc + turn[3] * dr
        along_u = abs(du) >= abs(dv)
        step = du if along_u else dv
        is_passed = links == 2 and along_u == last_along_u and step * last_step < 0.0
        last_step, last_along_u = step, along_u
        if k < 4:
            u1, v1 = _centre(inverse, turn, r + dr, c + dc)
            start, end = (u, v, int(cells[r, c])), (u1, v1, int(cells[r + dr, c + dc]))
            _draw_link(out, row0, col0, start, end, along_u)
    is_sampled = links == 0 and is_area and ratio <= SAMPLES_ALL
    if not is_sampled and not (is_passed and not is_area):
        _put(out, int(math.floor(v)) - row0, int(math.floor(u)) - col0, cells[r, c])
