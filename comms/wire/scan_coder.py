"""Keyframes' scans as an adaptive arithmetic code: steps of the bearing, and what walls do not tell of the range.

Points come by bearing, as far apart across the beams as those before, so the range predicts the step; and they mostly
lie on the straight line through the two before, or as far away as the last. Whichever of these two guesses missed by
less of late is used, and how much it missed by is the context of what is left.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.comms.wire.binary_coder import HALF, begin, code_value, contexts, decide, end

COUNT_BITS = 6
"""Numbers of points below 64; 60 is the most."""
LENGTH_BITS = 5
"""A number's length in bits is below 32; bearings and ranges need 17."""
LEARNT_DIGITS = 6
"""A number's highest digits have chances of their own each; the lower ones are as good as random."""
STEP_CONTEXTS = 32
"""Of the step that is expected: none, and two to each octave."""
MISS_CONTEXTS, FIRST = 11, 10
"""Of how far the guess missed of late: ten octaves; and of the first range, for which there is no guess."""
UNSETTLED = 16
"""A guess that has not been tried yet counts as missing by four steps, of which each is 4 here."""
MISS_MOST = 255
"""A greater miss is a jump from one thing to another, and says no more about the guess."""
BEARINGS, RANGE_MOST, POINTS_MOST = 8192, 65535, 60
"""As in ``mrslam.spatial.key_scans``; nothing beyond is ever read."""
ONE = 1 << 20
"""Sines are whole numbers, of so many."""
SINE = np.round(ONE * np.sin(2.0 * np.pi * np.arange(BEARINGS) / BEARINGS)).astype(np.int64)
"""``(8192,)``; no sine is so near to a half that machines could round it differently."""


class Chances(NamedTuple):
    """What has been learnt, by what it is about; see :func:`mrslam.comms.wire.binary_coder.decide`."""

    counts: NDArray[np.int64]
    lasers: NDArray[np.int64]
    step_lengths: NDArray[np.int64]
    step_digits: NDArray[np.int64]
    kinds: NDArray[np.int64]
    miss_lengths: NDArray[np.int64]
    miss_digits: NDArray[np.int64]


@njit(cache=True, nogil=True)
def _nothing_learnt() -> Chances:  # pragma: no cover - compiled
    digits = 1 << (LENGTH_BITS + LEARNT_DIGITS)
    return Chances(
        contexts(1 << COUNT_BITS, HALF),
        contexts(5 << 8, HALF),
        contexts(STEP_CONTEXTS << LENGTH_BITS, HALF),
        contexts(digits, HALF),
        contexts(2 * MISS_CONTEXTS, HALF),
        contexts(MISS_CONTEXTS << LENGTH_BITS, HALF),
        contexts(digits, HALF),
    )


@njit(cache=True, nogil=True)
def _length(value: int) -> int:  # pragma: no cover - compiled
    """Return how many bits a number takes."""
    bits = 0
    while value > 0:
        bits += 1
        value >>= 1
    return bits


@njit(cache=True, nogil=True)
def _number(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    lengths: NDArray[np.int64],
    digits: NDArray[np.int64],
    context: int,
    value: int,
) -> int:  # pragma: no cover - compiled
    """Write a number of at least 0, or read and return it: its length under the context, then its digits."""
    length = code_value(state, buffer, writing, lengths, context, LENGTH_BITS, _length(value))
    if length == 0:
        return 0
    out = node = 1
    for s in range(length - 2, -1, -1):
        learnt = length - 2 - s < LEARNT_DIGITS
        known = (length << LEARNT_DIGITS) + node if learnt else s  # lengths with digits are 2 or more: these are free
        bit = decide(state, buffer, writing, digits, known, (value >> s) & 1)
        out = 2 * out + bit
        if learnt:
            node = 2 * node + bit
    return out


@njit(cache=True, nogil=True)
def _on_line(
    b0: int, r0: int, b1: int, r1: int, b2: int, sine: NDArray[np.int64]
) -> int:  # pragma: no cover - compiled
    """Return the range at bearing ``b2`` of the line through two points; ``r1`` where it is far beyond both."""
    if b1 == b0:
        return r1
    above = r0 * r1 * sine[b1 - b0]
    below = r0 * sine[b2 - b0] - r1 * sine[b2 - b1]
    if above <= 0 or below <= 0 or above >= 4 * max(r0, r1) * below:
        return r1
    return min(max(above // below, 1), RANGE_MOST)


@njit(cache=True, nogil=True)
def _range(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    chances: Chances,
    recent: int,
    guess: int,
    value: int,
) -> int:  # pragma: no cover - compiled
    """Write a range, or read and return it, by how far a guess that missed by ``recent`` of late misses it."""
    context = min(_length(recent), FIRST - 1)
    if decide(state, buffer, writing, chances.kinds, context, 1 if value == guess else 0):
        return guess
    nearer = decide(state, buffer, writing, chances.kinds, MISS_CONTEXTS + context, 1 if value < guess else 0)
    rest = abs(value - guess) - 1
    miss = 1 + _number(state, buffer, writing, chances.miss_lengths, chances.miss_digits, context, rest)
    return guess - miss if nearer else guess + miss


@njit(cache=True, nogil=True)
def _scan(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    chances: Chances,
    polar: NDArray[np.uint16],
    sine: NDArray[np.int64],
) -> bool:  # pragma: no cover - compiled
    """Write the points ``(n, 2)`` of a keyframe, or read them; return whether what was read are points."""
    steps, digits = chances.step_lengths, chances.step_digits
    b0 = r0 = b1 = r1 = apart = 0
    flat = straight = UNSETTLED
    for i in range(polar.shape[0]):
        b, r = int(polar[i, 0]), int(polar[i, 1])
        context = 0
        if i > 1:
            length = _length(apart // r1)
            context = 1 + min(2 * length + ((apart // r1) >> max(length - 2, 0)) % 2, STEP_CONTEXTS - 2)
        elif i == 1:
            context = 1
        b = b1 + _number(state, buffer, writing, steps, digits, context, b - b1)
        if b >= BEARINGS:
            return False
        if i == 0:
            r = _number(state, buffer, writing, chances.miss_lengths, chances.miss_digits, FIRST, r)
        else:
            line = _on_line(b0, r0, b1, r1, b, sine) if i > 1 else r1
            guess, recent = (line, straight) if straight < flat else (r1, flat)
            r = _range(state, buffer, writing, chances, recent, guess, r)
            flat += (4 * min(abs(r - r1), MISS_MOST) - flat) >> 1
            straight += (4 * min(abs(r - line), MISS_MOST) - straight) >> 1
        if not 0 < r <= RANGE_MOST:
            return False
        apart = (b - b1) * r1
        b0, r0, b1, r1 = b1, r1, b, r
        polar[i, 0], polar[i, 1] = b, r
    return True


@njit(cache=True, nogil=True)
def _laser(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    chances: NDArray[np.int64],
    lasers: NDArray[np.int64],
    k: int,
) -> None:  # pragma: no cover - compiled
    """Write where the laser was at keyframe ``k``, 32 bits, or read it; next to nothing where it stayed."""
    before = lasers[k - 1] if k > 0 else 0
    if decide(state, buffer, writing, chances, 0, 1 if lasers[k] == before else 0):
        lasers[k] = before
        return
    value = 0
    for part in range(4):
        shift = 24 - 8 * part
        value |= code_value(state, buffer, writing, chances, 1 + part, 8, (lasers[k] >> shift) & 255) << shift
    lasers[k] = value


@njit(cache=True, nogil=True)
def code_scans(
    counts: NDArray[np.int64],
    lasers: NDArray[np.int64],
    polar: NDArray[np.uint16],
    known: int,
    buffer: NDArray[np.uint8],
    writing: bool,
    sine: NDArray[np.int64],
) -> int:  # pragma: no cover - compiled
    """Code the scans of K keyframes, all but the first ``known``, into ``buffer``, or read them from it.

    ``counts (K,)`` points of each; ``lasers (K,)`` 32 bits each; ``polar (P, 2)``, to be read: with room for
    ``POINTS_MOST`` points of each keyframe that is not known. Those known only teach what scans look like here.
    Returns the bytes needed; more than ``buffer`` has where it is too small. Reading past its end reads zeros; what
    are no scans is -1.
    """
    state, lesson = begin(buffer, writing), begin(buffer[:0], True)
    chances, at = _nothing_learnt(), 0
    for k in range(counts.size):
        coder, out, to_write = (lesson, buffer[:0], True) if k < known else (state, buffer, writing)
        count = code_value(coder, out, to_write, chances.counts, 0, COUNT_BITS, counts[k])
        if count > POINTS_MOST:
            return -1
        counts[k] = count
        _laser(coder, out, to_write, chances.lasers, lasers, k)
        if not _scan(coder, out, to_write, chances, polar[at : at + count], sine):
            return -1
        at += count
    return end(state, buffer, writing)
