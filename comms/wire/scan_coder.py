"""Keyframes' scans as an adaptive arithmetic code: steps of the bearing, and the error of a predicted range.

Points are in order of bearing. Neighbours are about equally far apart, so the last distance and range predict the step.
A range is predicted by the last one, or by the straight line through the last two points: by whichever of the two had
the smaller error recently, and that error is the context under which the remaining one is coded.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba import njit
from numpy.typing import NDArray

from mrslam.comms.wire.binary_coder import HALF, begin, code_value, contexts, decide, end

COUNT_BITS = 6
"""Bits of a keyframe's number of points, at most 60 (the format)."""
LENGTH_BITS = 5
"""Bits of a number's length in bits, below 32 (the format); bearings and ranges need 17."""
MODELLED_DIGITS = 6
"""A number's highest digits below the first have a model for each prefix; the lower ones are nearly random, and share
one for each place (the format)."""
STEP_CONTEXTS = 32
"""Contexts of the expected step of the bearing: none, and two to each octave (the format)."""
MISS_CONTEXTS, FIRST = 11, 10
"""Contexts of the recent error of the predicted range: ten octaves, and one for the first range, which has none (the
format)."""
UNSETTLED = 16
"""Recent error of a prediction before its first use, quarters of a range step: four steps (the format)."""
MISS_MOST = 255
"""Greatest error counted, range steps: a jump to another object says nothing about the next point (the format)."""
BEARINGS, RANGE_MOST, POINTS_MOST = 8192, 65535, 60
"""Bearings in a turn, greatest range in steps, most points of a keyframe: those of ``mrslam.spatial.key_scans``,
repeated since kernel files import no other package; nothing beyond is ever read."""
ONE = 1 << 20
"""Scale of the sines, which are whole numbers."""
SINE = np.round(ONE * np.sin(2.0 * np.pi * np.arange(BEARINGS) / BEARINGS)).astype(np.int64)
"""``(8192,)``; no sine is so near to a half that machines could round it differently."""


class ScanModels(NamedTuple):
    """Adaptive models ``(C, 2)`` by what they code, see :func:`mrslam.comms.wire.binary_coder.contexts`."""

    counts: NDArray[np.int64]
    lasers: NDArray[np.int64]
    step_lengths: NDArray[np.int64]
    step_digits: NDArray[np.int64]
    kinds: NDArray[np.int64]
    miss_lengths: NDArray[np.int64]
    miss_digits: NDArray[np.int64]


@njit(cache=True, nogil=True)
def _fresh_models() -> ScanModels:  # pragma: no cover - compiled
    digits = 1 << (LENGTH_BITS + MODELLED_DIGITS)
    return ScanModels(
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
    """Return the length of a number in bits; 0 for 0."""
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
        modelled = length - 2 - s < MODELLED_DIGITS
        known = (
            (length << MODELLED_DIGITS) + node if modelled else s
        )  # lengths with digits are 2 or more: these are free
        bit = decide(state, buffer, writing, digits, known, (value >> s) & 1)
        out = 2 * out + bit
        if modelled:
            node = 2 * node + bit
    return out


@njit(cache=True, nogil=True)
def _on_line(
    b0: int, r0: int, b1: int, r1: int, b2: int, sine: NDArray[np.int64]
) -> int:  # pragma: no cover - compiled
    """Return the range at bearing ``b2`` of the line through two points, or ``r1`` where it is far beyond both."""
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
    models: ScanModels,
    recent: int,
    guess: int,
    value: int,
) -> int:  # pragma: no cover - compiled
    """Write a range, or read and return it, as the error of ``guess``; ``recent``: its recent error, quarter steps."""
    context = min(_length(recent), FIRST - 1)
    if decide(state, buffer, writing, models.kinds, context, 1 if value == guess else 0):
        return guess
    nearer = decide(state, buffer, writing, models.kinds, MISS_CONTEXTS + context, 1 if value < guess else 0)
    rest = abs(value - guess) - 1
    miss = 1 + _number(state, buffer, writing, models.miss_lengths, models.miss_digits, context, rest)
    return guess - miss if nearer else guess + miss


@njit(cache=True, nogil=True)
def _scan(
    state: NDArray[np.int64],
    buffer: NDArray[np.uint8],
    writing: bool,
    models: ScanModels,
    polar: NDArray[np.uint16],
    sine: NDArray[np.int64],
) -> bool:  # pragma: no cover - compiled
    """Write the points ``(n, 2)`` (bearing, range) of a keyframe, or read them; return False for a bad code."""
    steps, digits = models.step_lengths, models.step_digits
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
            r = _number(state, buffer, writing, models.miss_lengths, models.miss_digits, FIRST, r)
        else:
            line = _on_line(b0, r0, b1, r1, b, sine) if i > 1 else r1
            guess, recent = (line, straight) if straight < flat else (r1, flat)
            r = _range(state, buffer, writing, models, recent, guess, r)
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
    models: NDArray[np.int64],
    lasers: NDArray[np.int64],
    k: int,
) -> None:  # pragma: no cover - compiled
    """Write where the laser was at keyframe ``k``, 32 bits, or read it; next to nothing where it stayed."""
    before = lasers[k - 1] if k > 0 else 0
    if decide(state, buffer, writing, models, 0, 1 if lasers[k] == before else 0):
        lasers[k] = before
        return
    value = 0
    for part in range(4):
        shift = 24 - 8 * part
        value |= code_value(state, buffer, writing, models, 1 + part, 8, (lasers[k] >> shift) & 255) << shift
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
    ``POINTS_MOST`` points of each keyframe that is not known. Scans known are coded first, into nothing: they only
    train the models. Returns the bytes needed, more than ``buffer`` has where it is too small; -1 for a bad code.
    Reading past the buffer's end reads zeros.
    """
    state, primer = begin(buffer, writing), begin(buffer[:0], True)
    models, at = _fresh_models(), 0
    for k in range(counts.size):
        coder, out, to_write = (primer, buffer[:0], True) if k < known else (state, buffer, writing)
        count = code_value(coder, out, to_write, models.counts, 0, COUNT_BITS, counts[k])
        if count > POINTS_MOST:
            return -1
        counts[k] = count
        _laser(coder, out, to_write, models.lasers, lasers, k)
        if not _scan(coder, out, to_write, models, polar[at : at + count], sine):
            return -1
        at += count
    return end(state, buffer, writing)
