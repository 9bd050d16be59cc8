"""Cells of tiles as decisions for the arithmetic coder: what the neighbourhood predicts costs next to nothing.

Each cell is coded as "still what the asker holds?" and, where it is not, its new value; both under contexts of the held
value and of the neighbours just coded. Squares of 8 x 8 cells without any change, and new ones of a single value, cost
a few decisions. Cells are converted to ``int`` before arithmetic: a uint8 would wrap where kernels run as plain Python.
docs/protocol.md defines every context. The small kernels are inlined: calls would cost a tenth of the time.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.comms.wire.binary_coder import HALF, begin, code_value, contexts, decide, end

SIDE = 64
"""Edge of a tile, cells: ``mrslam.spatial.TILE_CELLS``, repeated since kernel files import no other package."""
SQUARE = 8
"""Edge of a square that is skipped where nothing changed, cells (the format)."""
PER_SIDE = SIDE // SQUARE
"""Squares along a tile's edge."""
CLASSES = 8
"""Cell values that contexts distinguish: palette indices 0 to 6, and all above (the format)."""
TOP = CLASSES - 1
"""The class of all values above."""
NEAR = 27
"""States of the west, north and north-west neighbours together: each as held, unknown now, or another value."""
KNOWN = 16
"""Which of the west, north, east and south neighbours are known, as bits."""


@njit(cache=True, nogil=True, inline="always")
def _moved(value: int, held: int) -> int:  # pragma: no cover - compiled
    """Return 0 for a cell that is what the asker holds, 1 for one unknown now, 2 for another value."""
    if value == held:
        return 0
    return 1 if value == 0 else 2


@njit(cache=True, nogil=True, inline="always")
def _value_context(old: int, west: int, north: int) -> int:  # pragma: no cover - compiled
    """Return the context of a new value."""
    return (min(old, TOP) * CLASSES + min(west, TOP)) * CLASSES + min(north, TOP)


@njit(cache=True, nogil=True, inline="always")
def _square_facts(
    cells: NDArray[np.uint8], held: NDArray[np.uint8], r0: int, c0: int, writing: bool
) -> tuple[int, int, int]:  # pragma: no cover - compiled
    """Return whether a square of a tile ``(64, 64)`` changed, was known in part, and is of a single value, as 0 or 1.

    A reader knows only the second.
    """
    changed, was_known, single = 0, 0, 1
    first = int(cells[r0, c0])
    for r in range(r0, r0 + SQUARE):
        for c in range(c0, c0 + SQUARE):
            if held[r, c] != 0:
                was_known = 1
            if writing and cells[r, c] != held[r, c]:
                changed = 1
            if writing and cells[r, c] != first:
                single = 0
    return changed, was_known, single


@njit(cache=True, nogil=True, inline="always")
def _keep_context(
    cells: NDArray[np.uint8], held: NDArray[np.uint8], r: int, c: int, west: int, north: int
) -> int:  # pragma: no cover - compiled
    """Return the context of "is this cell still what the asker holds?"."""
    up, left = r > 0, c > 0
    near = 0
    if left:
        near += _moved(west, held[r, c - 1])
    if up:
        near += 3 * _moved(north, held[r - 1, c])
    if up and left:
        near += 9 * _moved(cells[r - 1, c - 1], held[r - 1, c - 1])
    known = (1 if west != 0 else 0) + (2 if north != 0 else 0)
    if c < SIDE - 1 and held[r, c + 1] != 0:
        known += 4
    if r < SIDE - 1 and held[r + 1, c] != 0:
        known += 8
    return (min(int(held[r, c]), TOP) * KNOWN + known) * NEAR + near


@njit(cache=True, nogil=True)
def code(
    cells: NDArray[np.uint8], held: NDArray[np.uint8], bits: int, buffer: NDArray[np.uint8], writing: bool
) -> int:  # pragma: no cover - compiled
    """Code palette indices ``cells (N, 64, 64) < 2**bits`` against ``held`` into ``buffer``, or read them from it.

    Returns the bytes needed; more than ``buffer`` has where it is too small. Reading past its end reads zeros.
    """
    state = begin(buffer, writing)
    changes, singles = contexts(8, HALF), contexts(8, HALF)
    keeps, values = contexts(CLASSES * KNOWN * NEAR, HALF // 2), contexts(CLASSES * CLASSES * CLASSES << bits, HALF)
    # Squares with changes, and of a single value; row and column 0 lie outside of the tile.
    busy = np.zeros((PER_SIDE + 1, PER_SIDE + 1), dtype=np.int64)
    even = np.zeros((PER_SIDE + 1, PER_SIDE + 1), dtype=np.int64)
    for t in range(cells.shape[0]):
        new, old = cells[t], held[t]
        for square in range(PER_SIDE * PER_SIDE):
            i, j = square // PER_SIDE, square % PER_SIDE
            r0, c0 = i * SQUARE, j * SQUARE
            changed, was_known, single = _square_facts(new, old, r0, c0, writing)
            context = busy[i, j + 1] + 2 * busy[i + 1, j] + 4 * was_known
            changed = decide(state, buffer, writing, changes, context, changed)
            busy[i + 1, j + 1], even[i + 1, j + 1] = changed, 0
            if not changed:
                new[r0 : r0 + SQUARE, c0 : c0 + SQUARE] = old[r0 : r0 + SQUARE, c0 : c0 + SQUARE]
                continue
            context = even[i, j + 1] + 2 * even[i + 1, j] + 4 * was_known
            single = decide(state, buffer, writing, singles, context, single)
            even[i + 1, j + 1] = single
            if not single:
                _code_square(state, buffer, writing, keeps, values, new, old, bits, square)
                continue
            west = int(new[r0, c0 - 1]) if c0 > 0 else 0
            north = int(new[r0 - 1, c0]) if r0 > 0 else 0
            context = _value_context(int(old[r0, c0]), west, north)
            value = code_value(state, buffer, writing, values, context, bits, int(new[r0, c0]))
            new[r0 : r0 + SQUARE, c0 : c0 + SQUARE] = value
    return end(state, buffer, writing)


@njit(cache=True, nogil=True)
def _code_square(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    keeps: NDArray[np.int64],
    values: NDArray[np.int64],
    cells: NDArray[np.uint8],
    held: NDArray[np.uint8],
    bits: int,
    square: int,
) -> None:  # pragma: no cover - compiled
    """Code each cell of one square of a tile ``(64, 64)``: kept or not, and if not, its value."""
    r0, c0 = square // PER_SIDE * SQUARE, square % PER_SIDE * SQUARE
    for r in range(r0, r0 + SQUARE):
        for c in range(c0, c0 + SQUARE):
            value, old = int(cells[r, c]), int(held[r, c])
            west = int(cells[r, c - 1]) if c > 0 else 0
            north = int(cells[r - 1, c]) if r > 0 else 0
            context = _keep_context(cells, held, r, c, west, north)
            if not decide(state, buffer, writing, keeps, context, 1 if value != old else 0):
                cells[r, c] = old
                continue
            cells[r, c] = code_value(state, buffer, writing, values, _value_context(old, west, north), bits, value)
