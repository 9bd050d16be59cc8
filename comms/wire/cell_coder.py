"""Cells as an adaptive binary arithmetic code: what the neighbourhood tells already costs next to nothing.

Each cell is coded as "still what the asker holds?" and, where it is not, its new value; both under contexts of the held
value and of the neighbours just coded, as JBIG and CABAC do (Howard and Vitter 1992; Marpe et al. 2003). Squares of
8 x 8 cells without any change, and new ones of a single value, cost a few decisions. Integers only: the same bytes on
every machine. One kernel codes and decodes, so that the two cannot drift apart. Cells are taken as ``int`` before they
are counted with: a uint8 would wrap where the kernels run as plain Python.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

SIDE = 64
"""Edge of a tile, cells."""
SQUARE = 8
"""Edge of a square that is skipped where nothing changed, cells."""
CLASSES = 8
"""Cell values that contexts tell apart (palette indices 0 to 6, and all above)."""
SLOWEST = 40
"""A context's probability moves by 1/2 at its first bit, by 1/3 at the next, and at least by 1/40."""
LEAST = 64
"""Least probability of either bit, of 65536."""
READ_AHEAD = 3
"""Reading looks so many bytes further than what was written."""
LOW, HIGH, CODE, AT = 0, 1, 2, 3
"""Fields of the coder's state: interval, window of the code being read, place in the buffer."""


@njit(cache=True, nogil=True)
def _decide(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    chances: NDArray[np.int64],
    context: int,
    bit: int,
) -> int:  # pragma: no cover - compiled
    """Write ``bit``, or read and return it, under a context; ``chances (C, 2)``: probability of 1 (of 65536), count."""
    low, high = state[LOW], state[HIGH]
    p = chances[context, 0]
    span = high - low
    middle = low + (span >> 16) * p + (((span & 0xFFFF) * p) >> 16)
    if not writing:
        bit = 1 if state[CODE] <= middle else 0
    if bit:
        high = middle
    else:
        low = middle + 1
    while (low ^ high) & 0xFF000000 == 0:
        at = state[AT]
        if writing:
            if at < buffer.size:
                buffer[at] = high >> 24
        else:
            state[CODE] = ((state[CODE] << 8) & 0xFFFFFFFF) | (buffer[at] if at < buffer.size else 0)
        state[AT] = at + 1
        low = (low << 8) & 0xFFFFFFFF
        high = ((high << 8) & 0xFFFFFFFF) | 0xFF
    state[LOW], state[HIGH] = low, high
    count = chances[context, 1]
    if bit:
        p += (65536 - p) // (count + 2)
    else:
        p -= p // (count + 2)
    chances[context, 0] = min(max(p, LEAST), 65536 - LEAST)
    chances[context, 1] = min(count + 1, SLOWEST - 2)
    return bit


@njit(cache=True, nogil=True)
def _value(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    chances: NDArray[np.int64],
    context: int,
    bits: int,
    value: int,
) -> int:  # pragma: no cover - compiled
    """Write a value of so many bits, or read and return it: a binary tree of decisions, highest bit first."""
    node = 1
    for s in range(bits - 1, -1, -1):
        bit = _decide(state, buffer, writing, chances, (context << bits) + node, (value >> s) & 1)
        node = 2 * node + bit
    return node - (1 << bits)


@njit(cache=True, nogil=True)
def _moved(value: int, held: int) -> int:  # pragma: no cover - compiled
    """Return 0 for a cell that is what the asker holds, 1 for one unknown now, 2 for another value."""
    if value == held:
        return 0
    return 1 if value == 0 else 2


@njit(cache=True, nogil=True)
def code(
    cells: NDArray[np.uint8], held: NDArray[np.uint8], bits: int, buffer: NDArray[np.uint8], writing: bool
) -> int:  # pragma: no cover - compiled
    """Code palette indices ``cells (N, 64, 64) < 2**bits`` against ``held`` into ``buffer``, or read them from it.

    Returns the bytes needed; more than ``buffer`` has where it is too small. Reading past its end reads zeros.
    """
    state = np.zeros(4, dtype=np.int64)
    state[HIGH] = 0xFFFFFFFF
    if not writing:
        for k in range(4):
            state[CODE] = (state[CODE] << 8) | (buffer[k] if k < buffer.size else 0)
        state[AT] = 4
    square_chances = np.full((8, 2), 32768, dtype=np.int64)
    even_chances = np.full((8, 2), 32768, dtype=np.int64)
    keep_chances = np.full((CLASSES * 16 * 27, 2), 16384, dtype=np.int64)
    value_chances = np.full((CLASSES * CLASSES * CLASSES << bits, 2), 32768, dtype=np.int64)
    square_chances[:, 1] = 0
    even_chances[:, 1] = 0
    keep_chances[:, 1] = 0
    value_chances[:, 1] = 0
    top = CLASSES - 1
    per_side = SIDE // SQUARE
    busy = np.zeros((per_side + 1, per_side + 1), dtype=np.int64)  # squares with changes; row and column 0: outside
    even = np.zeros((per_side + 1, per_side + 1), dtype=np.int64)  # squares of a single value
    for t in range(cells.shape[0]):
        for square in range(per_side * per_side):
            i, j = square // per_side, square % per_side
            r0, c0 = i * SQUARE, j * SQUARE
            changed, was_known, single = 0, 0, 1
            first = int(cells[t, r0, c0])
            for r in range(r0, r0 + SQUARE):
                for c in range(c0, c0 + SQUARE):
                    if held[t, r, c] != 0:
                        was_known = 1
                    if writing and cells[t, r, c] != held[t, r, c]:
                        changed = 1
                    if writing and cells[t, r, c] != first:
                        single = 0
            context = busy[i, j + 1] + 2 * busy[i + 1, j] + 4 * was_known
            changed = _decide(state, buffer, writing, square_chances, context, changed)
            busy[i + 1, j + 1] = changed
            even[i + 1, j + 1] = 0
            if not changed:
                cells[t, r0 : r0 + SQUARE, c0 : c0 + SQUARE] = held[t, r0 : r0 + SQUARE, c0 : c0 + SQUARE]
                continue
            context = even[i, j + 1] + 2 * even[i + 1, j] + 4 * was_known
            single = _decide(state, buffer, writing, even_chances, context, single)
            even[i + 1, j + 1] = single
            if single:
                west = int(cells[t, r0, c0 - 1]) if c0 > 0 else 0
                north = int(cells[t, r0 - 1, c0]) if r0 > 0 else 0
                context = (min(int(held[t, r0, c0]), top) * CLASSES + min(west, top)) * CLASSES + min(north, top)
                value = _value(state, buffer, writing, value_chances, context, bits, first)
                cells[t, r0 : r0 + SQUARE, c0 : c0 + SQUARE] = value
                continue
            for r in range(r0, r0 + SQUARE):
                for c in range(c0, c0 + SQUARE):
                    old = int(held[t, r, c])
                    up, left = r > 0, c > 0
                    west = int(cells[t, r, c - 1]) if left else 0
                    north = int(cells[t, r - 1, c]) if up else 0
                    around = 0
                    if left:
                        around += _moved(west, held[t, r, c - 1])
                    if up:
                        around += 3 * _moved(north, held[t, r - 1, c])
                    if up and left:
                        around += 9 * _moved(cells[t, r - 1, c - 1], held[t, r - 1, c - 1])
                    known = (1 if west != 0 else 0) + (2 if north != 0 else 0)
                    if c < SIDE - 1 and held[t, r, c + 1] != 0:
                        known += 4
                    if r < SIDE - 1 and held[t, r + 1, c] != 0:
                        known += 8
                    value = int(cells[t, r, c])
                    context = (min(old, top) * 16 + known) * 27 + around
                    if not _decide(state, buffer, writing, keep_chances, context, 1 if value != old else 0):
                        cells[t, r, c] = old
                        continue
                    context = (min(old, top) * CLASSES + min(west, top)) * CLASSES + min(north, top)
                    cells[t, r, c] = _value(state, buffer, writing, value_chances, context, bits, value)
    if not writing:
        return state[AT]
    at = state[AT]
    if at < buffer.size:
        buffer[at] = state[HIGH] >> 24  # the ends of the last interval differ in this byte, and zeros follow
    return at + 1


@njit(cache=True, nogil=True)
def mark_present(cells: NDArray[np.uint8], present: NDArray[np.bool_]) -> None:  # pragma: no cover - compiled
    """Set ``present (256,)`` at each byte that occurs in ``cells (N, 64, 64)``."""
    flat = cells.reshape(-1)
    for i in range(flat.size):
        present[flat[i]] = True


@njit(cache=True, nogil=True)
def look_up(
    table: NDArray[np.uint8], cells: NDArray[np.uint8], out: NDArray[np.uint8]
) -> int:  # pragma: no cover - compiled
    """Write ``table (256,)`` at each cell to ``out`` of the same shape, and return the greatest cell."""
    source, target = cells.reshape(-1), out.reshape(-1)
    greatest = 0
    for i in range(source.size):
        greatest = max(greatest, int(source[i]))
        target[i] = table[source[i]]
    return greatest
