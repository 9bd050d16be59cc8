"""Numbers out of text, fast: most of the time it takes to read a log."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

DIGITS_MOST = 15
"""A decimal of so many digits is a whole number and a power of ten that are both exact, and so is rounded once."""
TENS: NDArray[np.float64] = 10.0 ** np.arange(DIGITS_MOST + 1, dtype=np.float64)
SPACE, PLUS, MINUS, POINT, ZERO, NINE = (ord(c) for c in " +-.09")


@njit(cache=True, nogil=True)
def plain_decimals(
    text: NDArray[np.uint8], tens: NDArray[np.float64], out: NDArray[np.float64]
) -> int:  # pragma: no cover - compiled
    """Write the decimals between the spaces to ``out`` and return how many; -1 where anything is not as plain."""
    count, i, n = 0, 0, text.size
    while True:
        while i < n and text[i] == SPACE:
            i += 1
        if i == n:
            return count
        negative = text[i] == MINUS
        if negative or text[i] == PLUS:
            i += 1
        whole, digits, decimals, after = np.int64(0), 0, 0, False
        while i < n and text[i] != SPACE:
            if text[i] == POINT and not after:
                after = True
            elif ZERO <= text[i] <= NINE:
                whole = 10 * whole + (np.int64(text[i]) - ZERO)
                digits += 1
                decimals += after
                if digits > DIGITS_MOST:
                    return -1
            else:
                return -1
            i += 1
        if digits == 0:
            return -1
        value = whole / tens[decimals]
        out[count] = -value if negative else value
        count += 1


def parse(text: str) -> NDArray[np.float64]:
    """Return the numbers of a line of text; raise ``ValueError`` where one of its words is none."""
    out = np.empty(len(text) // 2 + 1)
    count = plain_decimals(np.frombuffer(text.encode(), dtype=np.uint8), TENS, out)
    return out[:count].copy() if count >= 0 else np.array(text.split(), dtype=np.float64)


def warm_up() -> None:
    """Compile the kernel of this module."""
    parse("1.5 -2")
