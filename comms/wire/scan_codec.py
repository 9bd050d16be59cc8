"""Keyframes' scans as bytes: about 65 a keyframe of 55 points, see docs/protocol.md."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from mrslam.comms.wire.binary_coder import READ_AHEAD
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.scan_coder import SINE, code_scans
from mrslam.spatial import InputError, KeyScans
from mrslam.spatial.key_scans import ORIGIN_M, POINTS_MOST

POINT_BYTES_MOST = 48
"""Room for a point that is written, bytes: its 37 decisions at most take 10 bits each at most."""
KEYFRAME_BYTES_MOST = 64
"""Room for a keyframe's count and laser, bytes: 39 such decisions."""


def pack_scans(scans: KeyScans, known: int) -> bytes:
    """Return the scans of all but the first ``known`` keyframes, coded for an asker that holds those."""
    counts = np.diff(scans.starts).astype(np.int64)
    size = KEYFRAME_BYTES_MOST * (1 + counts.size) + POINT_BYTES_MOST * scans.polar.shape[0]
    room = np.empty(size, dtype=np.uint8)
    used = code_scans(counts, _lasers(scans.origins), scans.polar.copy(), known, room, True, SINE)
    return room[:used].tobytes()


def unpack_scans(body: bytes, known: KeyScans, count: int) -> KeyScans:
    """Return the scans of the ``count`` keyframes after those ``known``; raise :class:`WireError` for a bad code."""
    before, points = len(known), known.polar.shape[0]
    counts, lasers = np.zeros(before + count, np.int64), np.zeros(before + count, np.int64)
    polar = np.zeros((points + POINTS_MOST * count, 2), np.uint16)
    counts[:before], lasers[:before], polar[:points] = np.diff(known.starts), _lasers(known.origins), known.polar
    coded = np.frombuffer(bytearray(body), dtype=np.uint8)
    if code_scans(counts, lasers, polar, before, coded, False, SINE) != coded.size + READ_AHEAD:
        raise WireError("bad keyframes", "scans")
    starts = np.concatenate([[0], np.cumsum(counts[before:])]).astype(np.int32)
    try:
        return KeyScans(starts, polar[points : points + starts[-1]].copy(), _origins(lasers[before:]))
    except InputError as error:
        raise WireError("bad keyframes", str(error)) from error


def scan_content(scans: KeyScans) -> bytes:
    """Return the bytes that hashes of scans are taken over."""
    counts, lasers = np.diff(scans.starts).astype("<i4"), _lasers(scans.origins).astype("<u4")
    return counts.tobytes() + lasers.tobytes() + scans.polar.astype("<u2").tobytes()


def _lasers(origins: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return positions of the laser ``(K, 2)``, metres in the base frame, as 32 bits each: x, y in mm, 16 bits each."""
    mm = np.round(origins.astype(np.float64) / ORIGIN_M).astype("<i2").astype("<u2").astype(np.int64)
    return mm[:, 0] << 16 | mm[:, 1]


def _origins(lasers: NDArray[np.int64]) -> NDArray[np.float32]:
    """Return the positions ``(K, 2)``, metres, of these bits ``(K,)``."""
    mm = np.stack([lasers >> 16, lasers & 0xFFFF], axis=-1).astype("<u2").view("<i2")
    return (mm * ORIGIN_M).astype(np.float32)
