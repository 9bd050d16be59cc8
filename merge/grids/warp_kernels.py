"""Rewriting a window of a rotated grid, cell by cell. Walls one cell thick are drawn as lines, not sampled."""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

OCCUPIED = 65
"""Equals ``mrslam.spatial.OCCUPIED_MIN``."""
LINKS = ((0, 1), (1, 0), (1, 1), (1, -1), (0, -1), (-1, 0), (-1, -1), (-1, 1))
"""(d row, d col) of the eight neighbours; the first four reach each pair of neighbours once."""


@njit(cache=True, nogil=True)
def _is_wall(cells: NDArray[np.int8], r: int, c: int) -> bool:  # pragma: no cover - compiled
    return 0 <= r < cells.shape[0] and 0 <= c < cells.shape[1] and cells[r, c] >= OCCUPIED


@njit(cache=True, nogil=True)
def _is_thick(cells: NDArray[np.int8], r: int, c: int) -> bool:  # pragma: no cover - compiled
    """Whether the wall cell is part of a 2 x 2 block of wall."""
    up, down = _is_wall(cells, r + 1, c), _is_wall(cells, r - 1, c)
    right, left = _is_wall(cells, r, c + 1), _is_wall(cells, r, c - 1)
    if up and right and _is_wall(cells, r + 1, c + 1):
        return True
    if up and left and _is_wall(cells, r + 1, c - 1):
        return True
    if down and right and _is_wall(cells, r - 1, c + 1):
        return True
    return down and left and _is_wall(cells, r - 1, c - 1)


@njit(cache=True, nogil=True)
def _beside(cells: NDArray[np.int8], r: int, c: int, fx: float, fy: float) -> int:  # pragma: no cover - compiled
    """Return what lies beside a thin wall cell on the side of the offset (fx, fy) from its centre."""
    sx, sy = (1 if fx >= 0.0 else -1), (1 if fy >= 0.0 else -1)
    for k in range(4):
        side = sx if k < 2 else -sx
        other = sy if k < 2 else -sy
        if (k % 2 == 0) == (abs(fx) >= abs(fy)):
            rr, cc = r, c + side
        else:
            rr, cc = r + other, c
        if not (0 <= rr < cells.shape[0] and 0 <= cc < cells.shape[1]):
            return -1
        if cells[rr, cc] < OCCUPIED:
            return cells[rr, cc]
    return cells[r, c]


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
def _sample(cells: NDArray[np.int8], sx: float, sy: float, draws_thin: bool) -> int:  # pragma: no cover - compiled
    """Return the value at a point of the source (in cells): thin walls give way to what is beside them."""
    c, r = int(math.floor(sx)), int(math.floor(sy))
    if not (0 <= r < cells.shape[0] and 0 <= c < cells.shape[1]):
        return -1
    value = cells[r, c]
    if value >= OCCUPIED and draws_thin and not _is_thick(cells, r, c):
        return _beside(cells, r, c, sx - c - 0.5, sy - r - 0.5)
    return value


@njit(cache=True, nogil=True)
def warp_window(
    cells: NDArray[np.int8], inverse: NDArray[np.float64], ratio: float, row0: int, col0: int, out: NDArray[np.int8]
) -> None:  # pragma: no cover - compiled
    """Write what the window ``out`` of the target lattice, from lattice cell (row0, col0), shows of the source.

    ``inverse`` is ``(2, 3)``: source cell coordinates (x = column, y = row) of a target point in cells;
    ``ratio`` = target resolution / source resolution. A window's content does not depend on where it is cut.
    """
    height, width = cells.shape
    draws_thin = ratio > 0.95
    samples = max(1, min(8, int(round(ratio))))
    for i in range(out.shape[0]):
        for j in range(out.shape[1]):
            if samples == 1:
                x, y = col0 + j + 0.5, row0 + i + 0.5
                sx = inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2]
                sy = inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2]
                out[i, j] = _sample(cells, sx, sy, draws_thin)
                continue
            known, total = 0, 0
            for k in range(samples * samples):
                x = col0 + j + (k % samples + 0.5) / samples
                y = row0 + i + (k // samples + 0.5) / samples
                sx = inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2]
                sy = inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2]
                value = _sample(cells, sx, sy, draws_thin)
                if value >= 0:
                    known += 1
                    total += value
            # Half known is known; walls are put back below, so that they win over free.
            out[i, j] = (2 * total + known) // (2 * known) if 2 * known >= samples * samples and known > 0 else -1
    det = inverse[0, 0] * inverse[1, 1] - inverse[0, 1] * inverse[1, 0]
    fxx, fxy = inverse[1, 1] / det, -inverse[0, 1] / det
    fyx, fyy = -inverse[1, 0] / det, inverse[0, 0] / det
    low_x, high_x, low_y, high_y = math.inf, -math.inf, math.inf, -math.inf
    for k in range(4):
        x = col0 + (out.shape[1] if k % 2 else 0)
        y = row0 + (out.shape[0] if k // 2 else 0)
        sx = inverse[0, 0] * x + inverse[0, 1] * y + inverse[0, 2]
        sy = inverse[1, 0] * x + inverse[1, 1] * y + inverse[1, 2]
        low_x, high_x, low_y, high_y = min(low_x, sx), max(high_x, sx), min(low_y, sy), max(high_y, sy)
    r_from, r_to = max(0, int(math.floor(low_y)) - 2), min(height, int(math.ceil(high_y)) + 3)
    c_from, c_to = max(0, int(math.floor(low_x)) - 2), min(width, int(math.ceil(high_x)) + 3)
    for r in range(r_from, r_to):
        for c in range(c_from, c_to):
            value = cells[r, c]
            if value < OCCUPIED:
                continue
            thick = not draws_thin or _is_thick(cells, r, c)
            x, y = c + 0.5 - inverse[0, 2], r + 0.5 - inverse[1, 2]
            u, v = fxx * x + fxy * y, fyx * x + fyy * y
            count, onward, last_way, last_along = 0, False, 0.0, False
            for k in range(8):
                dr, dc = LINKS[k]
                if not _is_wall(cells, r + dr, c + dc):
                    continue
                if dr != 0 and dc != 0:
                    if _is_wall(cells, r + dr, c) or _is_wall(cells, r, c + dc):
                        continue  # joined around the corner
                elif thick and (not draws_thin or _is_thick(cells, r + dr, c + dc)):
                    continue  # joined by the sampling
                count += 1
                # By direction alone: rounding must not choose another axis for the next link of a straight wall.
                along_u = abs(fxx * dc + fxy * dr) >= abs(fyx * dc + fyy * dr)
                way = fxx * dc + fxy * dr if along_u else fyx * dc + fyy * dr
                onward = count == 2 and along_u == last_along and way * last_way < 0.0
                last_way, last_along = way, along_u
                if k < 4:
                    x, y = c + dc + 0.5 - inverse[0, 2], r + dr + 0.5 - inverse[1, 2]
                    end = (fxx * x + fxy * y, fyx * x + fyy * y, int(cells[r + dr, c + dc]))
                    _draw_link(out, row0, col0, (u, v, int(value)), end, along_u)
            if (count == 0 and thick and ratio <= 1.05) or (onward and not thick):
                continue
            _put(out, int(math.floor(v)) - row0, int(math.floor(u)) - col0, value)
