"""An adaptive binary arithmetic coder in integers: the same bytes on every machine.

Each decision is coded under a context that keeps its own probability, as JBIG and CABAC do (Howard and Vitter 1992;
Marpe et al. 2003). One kernel writes and reads, so that the two cannot drift apart.
"""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

LOW, HIGH, CODE, AT = 0, 1, 2, 3
"""Fields of the coder's state: ends of the interval, window of the code being read, position in the buffer."""
HALF = 32768
"""A probability of 1/2, of 65536."""
SLOWEST = 40
"""A context's probability moves by 1/2 at its first bit, by 1/3 at the next, and at least by 1/40 (the format)."""
LEAST = 64
"""Least probability of either bit, of 65536 (the format)."""
READ_AHEAD = 3
"""A reader looks this many bytes beyond what was written: its window is four bytes, a writer's last piece is one."""


@njit(cache=True, nogil=True)
def begin(buffer: NDArray[np.uint8], writing: bool) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return the state ``(4,)`` of a coder at the start of ``buffer``."""
    state = np.zeros(4, dtype=np.int64)
    state[HIGH] = 0xFFFFFFFF
    if not writing:
        for k in range(4):
            state[CODE] = (state[CODE] << 8) | (buffer[k] if k < buffer.size else 0)
        state[AT] = 4
    return state


@njit(cache=True, nogil=True)
def contexts(count: int, probability: int) -> NDArray[np.int64]:  # pragma: no cover - compiled
    """Return models ``(count, 2)``, one a context: probability of 1 (of 65536), and bits seen (38 at most)."""
    made = np.zeros((count, 2), dtype=np.int64)
    made[:, 0] = probability
    return made


@njit(cache=True, nogil=True)
def end(state: NDArray[np.int64], buffer: NDArray[np.uint8], writing: bool) -> int:  # pragma: no cover - compiled
    """Finish, and return the bytes written or read."""
    at = state[AT]
    if not writing:
        return at
    if at < buffer.size:
        buffer[at] = state[HIGH] >> 24  # the ends of the last interval differ in this byte, and zeros follow
    return at + 1


@njit(cache=True, nogil=True)
def decide(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    models: NDArray[np.int64],
    context: int,
    bit: int,
) -> int:  # pragma: no cover - compiled
    """Write ``bit``, or read and return it, under a context; ``models (C, 2)``: as :func:`contexts` makes them."""
    low, high = state[LOW], state[HIGH]
    p = models[context, 0]
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
    count = models[context, 1]
    if bit:
        p += (65536 - p) // (count + 2)
    else:
        p -= p // (count + 2)
    models[context, 0] = min(max(p, LEAST), 65536 - LEAST)
    models[context, 1] = min(count + 1, SLOWEST - 2)
    return bit


@njit(cache=True, nogil=True, inline="always")
def code_value(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    models: NDArray[np.int64],
    context: int,
    bits: int,
    value: int,
) -> int:  # pragma: no cover - compiled
    """Write a value of ``bits`` bits, or read and return it: a binary tree of decisions, highest bit first."""
    node = 1
    for s in range(bits - 1, -1, -1):
        bit = decide(state, buffer, writing, models, (context << bits) + node, (value >> s) & 1)
        node = 2 * node + bit
    return node - (1 << bits)
