"""Compiled loops that find a map's walls: surface points with normals, and the nearest of them from anywhere."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.spatial.matching.axes import main_axis

UNKNOWN, FREE, OCCUPIED = 0, 1, 2
"""Cell states of a prepared map."""
NOTHING = 65535
"""Label where no wall is near; also the most wall points a map may have."""
REACH = 3
"""Half width of the window a wall's normal is taken from, cells."""

F64 = NDArray[np.float64]
I32 = NDArray[np.int32]
I64 = NDArray[np.int64]
U8 = NDArray[np.uint8]


class WallMap(NamedTuple):
    """A prepared map as kernels take it; metres in the map's own frame."""

    state: U8
    """``(H, W)``: UNKNOWN, FREE or OCCUPIED."""
    label: NDArray[np.uint16]
    """``(4, H, W)``: see :func:`nearest_labels`."""
    points: F64
    """``(N, 2)`` wall surface points."""
    normals: F64
    """``(N, 2)`` unit normals towards the free side, (0, 0) for specks."""
    solid: NDArray[np.bool_]
    """``(N,)``: whether a point is part of something large enough not to come and go."""
    x0: float
    """Left edge of ``state``."""
    y0: float
    """Lower edge of ``state``."""
    res: float
    """Edge of a cell."""


ONE_SIDED = 8.0
"""Length of the sum of the vectors to the free cells of a window, cells, above which a wall is free on one side only.
A straight wall's free side sums to 26 (7 x 1 + 5 x 2 + 3 x 3 cells); two free sides cancel."""
STRAIGHT = 0.6
"""Share (0..1) of the occupied cells' variance in a window by which its axes must differ to give a direction."""
MIN_STRAIGHT_CELLS = 4.0
"""Fewer occupied cells in a window give no direction."""


@njit(cache=True, nogil=True)
def wall_points(state: U8) -> tuple[I32, F64]:  # pragma: no cover - compiled
    """Return (row, col) of the walls' surfaces and their unit normals (x, y) towards the free side.

    A surface cell is occupied with a free cell among its eight neighbours. A wall free on both sides is returned twice,
    once per side; a speck that has no direction gets the normal (0, 0). ``state`` has a border of REACH unknown cells.
    """
    height, width = state.shape
    count = 0
    for r in range(REACH, height - REACH):
        for c in range(REACH, width - REACH):
            if state[r, c] == OCCUPIED:
                count += 2
    cells = np.empty((count, 2), dtype=np.int32)
    normals = np.empty((count, 2), dtype=np.float64)
    n = 0
    for r in range(REACH, height - REACH):
        for c in range(REACH, width - REACH):
            if state[r, c] != OCCUPIED or not touches_free(state, r, c):
                continue
            sides, nx, ny = facing(state, r, c)
            for _ in range(sides):
                cells[n, 0], cells[n, 1] = r, c
                normals[n, 0], normals[n, 1] = nx, ny
                nx, ny = -nx, -ny
                n += 1
    return cells[:n].copy(), normals[:n].copy()


@njit(cache=True, nogil=True)
def touches_free(state: U8, r: int, c: int) -> bool:  # pragma: no cover - compiled
    """Return whether one of a cell's eight neighbours is free."""
    for dr in range(-1, 2):
        for dc in range(-1, 2):
            if state[r + dr, c + dc] == FREE:
                return True
    return False


@njit(cache=True, nogil=True)
def facing(state: U8, r: int, c: int) -> tuple[int, float, float]:  # pragma: no cover - compiled
    """Return how many sides of the wall at a surface cell are free (1 or 2), and the normal (x, y) of the first.

    The normal points to the free cells of the window; where these lie on both sides, it is the least axis of the
    occupied cells' covariance; (0, 0) where that has no direction.
    """
    fx = fy = 0.0
    ox = oy = oxx = oxy = oyy = occupied = 0.0
    for dr in range(-REACH, REACH + 1):
        for dc in range(-REACH, REACH + 1):
            if dr * dr + dc * dc > REACH * REACH + 1:
                continue
            s = state[r + dr, c + dc]
            if s == FREE:
                fx += dc
                fy += dr
            elif s == OCCUPIED:
                ox += dc
                oy += dr
                oxx += dc * dc
                oxy += dc * dr
                oyy += dr * dr
                occupied += 1.0
    strength = math.sqrt(fx * fx + fy * fy)
    if strength > ONE_SIDED:
        return 1, fx / strength, fy / strength
    cxx = oxx - ox * ox / occupied
    cyy = oyy - oy * oy / occupied
    cxy = oxy - ox * oy / occupied
    spread = math.sqrt((cxx - cyy) ** 2 + 4.0 * cxy * cxy)
    if occupied < MIN_STRAIGHT_CELLS or spread < STRAIGHT * (cxx + cyy):
        return 1, 0.0, 0.0
    along = main_axis(cxx, cxy, cyy)
    return 2, -math.sin(along), math.cos(along)


@njit(cache=True, nogil=True)
def nearest_labels(
    height: int, width: int, cells: I32, normals: F64, reach: int
) -> NDArray[np.uint16]:  # pragma: no cover - compiled
    """Return ``(4, H, W)``: per quadrant of facing, the nearest of ``cells`` (row, col) within ``reach``, or NOTHING.

    Quadrant q holds the walls that face within 65 degrees of q x 90 degrees, and specks. At most NOTHING cells.
    """
    label = np.full((4, height * width), NOTHING, dtype=np.uint16)
    best = np.empty(height * width, dtype=np.uint8)
    span = 2 * reach + 1
    way = np.empty(span * span, dtype=np.int64)
    away = np.empty(span * span, dtype=np.uint8)
    down, right = np.empty(span * span, dtype=np.int64), np.empty(span * span, dtype=np.int64)
    m = 0
    for dr in range(-reach, reach + 1):
        for dc in range(-reach, reach + 1):
            d2 = dr * dr + dc * dc
            if d2 <= reach * reach and d2 < 255:
                way[m], away[m], down[m], right[m] = dr * width + dc, d2, dr, dc
                m += 1
    for q in range(4):
        best[:] = 255
        near = label[q]
        for i in range(cells.shape[0]):
            nx, ny = normals[i, 0], normals[i, 1]
            facing = nx if q == 0 else (ny if q == 1 else (-nx if q == 2 else -ny))
            if facing <= 0.42 and (nx != 0.0 or ny != 0.0):
                continue
            r, c = cells[i, 0], cells[i, 1]
            at = r * width + c
            inside = reach <= r < height - reach and reach <= c < width - reach
            for k in range(m):
                if not inside and not (0 <= r + down[k] < height and 0 <= c + right[k] < width):
                    continue
                if away[k] < best[at + way[k]]:
                    best[at + way[k]] = away[k]
                    near[at + way[k]] = i
    return label.reshape((4, height, width))


@njit(cache=True, nogil=True)
def root_of(parent: I32, i: int) -> int:  # pragma: no cover - compiled
    """Return the first cell of the thing that cell ``i`` is part of, and shorten the way to it."""
    while parent[i] != i:
        parent[i] = parent[parent[i]]
        i = parent[i]
    return i


@njit(cache=True, nogil=True)
def extents(rows: I64, cols: I64, gap: int, cells: I32) -> I64:  # pragma: no cover - compiled
    """Return how far the thing reaches that each of ``cells (N, 2)`` (row, col) is part of, along the longer axis.

    ``rows``, ``cols`` are all occupied cells, row by row; cells up to ``gap`` rows and columns apart are one thing.
    ``cells`` are some of them, in the same order.
    """
    n = rows.shape[0]
    parent = np.empty(n, dtype=np.int32)
    begin = np.empty(gap + 1, dtype=np.int64)  # by rows back: first cell there that may be near
    for i in range(n):
        parent[i] = i
        if i == 0 or rows[i] != rows[i - 1]:
            first = i
            for back in range(gap + 1):
                while first > 0 and rows[first - 1] >= rows[i] - back:
                    first -= 1
                begin[back] = first
        for back in range(gap + 1):
            row, j = rows[i] - back, begin[back]
            while j < i and rows[j] == row and cols[j] < cols[i] - gap:
                j += 1
            begin[back] = j
            while j < i and rows[j] == row and cols[j] <= cols[i] + gap:
                one, other = root_of(parent, i), root_of(parent, j)
                parent[max(one, other)] = min(one, other)
                j += 1
    box = np.empty((n, 4), dtype=np.int64)
    for i in range(n):
        k = root_of(parent, i)
        if k == i:
            box[k] = rows[i], rows[i], cols[i], cols[i]
        box[k, 1] = rows[i]
        box[k, 2], box[k, 3] = min(box[k, 2], cols[i]), max(box[k, 3], cols[i])
    out = np.empty(cells.shape[0], dtype=np.int64)
    j = 0
    for i in range(cells.shape[0]):
        while rows[j] != cells[i, 0] or cols[j] != cells[i, 1]:
            j += 1
        k = root_of(parent, j)
        out[i] = max(box[k, 1] - box[k, 0], box[k, 3] - box[k, 2]) + 1
    return out
