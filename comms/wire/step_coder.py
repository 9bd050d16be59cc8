"""Stamps and poses of keyframes as an adaptive arithmetic code of the steps from one keyframe to the next."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.comms.wire.binary_coder import HALF, begin, code_value, contexts, decide, end

COLUMNS = 4
"""Numbers of a step: stamp, x, y, theta."""
KINDS, KEPT, NEW = 2, 0, 1
"""Steps are of keyframes that the asker holds, whose poses were corrected, or of new ones (the format)."""
LENGTH_BITS = 7
"""Bits of a number's length in bits, 64 at most (the format)."""
MODELLED_DIGITS = 3
"""A number's highest digits below the first have a model for each prefix; the lower ones are nearly random, and share
one for each place (the format)."""


@njit(cache=True, nogil=True)
def code_steps(
    trained: NDArray[np.int64], steps: NDArray[np.int64], kept: int, buffer: NDArray[np.uint8], writing: bool
) -> int:  # pragma: no cover - compiled
    """Code ``steps (n, 4)``, of which the first ``kept`` are of keyframes that are held, or read them into it.

    ``trained (m, 4)`` : steps known to both sides, coded first into nothing: they only train the models of new ones.
    Returns the bytes needed, more than ``buffer`` has where it is too small. Reading past the buffer's end reads zeros.
    """
    state, primer = begin(buffer, writing), begin(buffer[:0], True)
    lengths = contexts((KINDS * COLUMNS) << LENGTH_BITS, HALF)
    digits = contexts(COLUMNS << (LENGTH_BITS + MODELLED_DIGITS), HALF)
    places = contexts(COLUMNS << LENGTH_BITS, HALF)
    for k in range(trained.shape[0]):
        for column in range(COLUMNS):
            _number(primer, buffer[:0], True, lengths, digits, places, NEW, column, trained[k, column])
    for k in range(steps.shape[0]):
        kind = KEPT if k < kept else NEW
        for column in range(COLUMNS):
            value = steps[k, column]
            steps[k, column] = _number(state, buffer, writing, lengths, digits, places, kind, column, value)
    return end(state, buffer, writing)


@njit(cache=True, nogil=True)
def _number(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    lengths: NDArray[np.int64],
    digits: NDArray[np.int64],
    places: NDArray[np.int64],
    kind: int,
    column: int,
    value: int,
) -> int:  # pragma: no cover - compiled
    """Write a number of 64 bits, or read and return it: the length of its zigzag, then the digits."""
    zigzag = (value << 1) ^ (value >> 63)
    length = 64 if zigzag < 0 else 0
    while length < 64 and zigzag >> length > 0:
        length += 1
    length = code_value(state, buffer, writing, lengths, kind * COLUMNS + column, LENGTH_BITS, length)
    if length == 0:
        return 0
    out = node = 1
    for s in range(min(length, 64) - 2, -1, -1):
        bit = (zigzag >> s) & 1
        if length - 2 - s < MODELLED_DIGITS:
            known = (((column << LENGTH_BITS) + length) << MODELLED_DIGITS) + node
            bit = decide(state, buffer, writing, digits, known, bit)
            node = 2 * node + bit
        else:
            bit = decide(state, buffer, writing, places, (column << LENGTH_BITS) + s, bit)
        out = (out << 1) | bit
    return ((out >> 1) & 0x7FFFFFFFFFFFFFFF) ^ -(out & 1)
