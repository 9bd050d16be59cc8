"""Keyframes as bytes: blocks of 64 with poses (mm, 0.1 mrad) and scans."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from mrslam.comms.wire.binary_coder import READ_AHEAD
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.scan_codec import pack_scans, scan_content, unpack_scans
from mrslam.comms.wire.step_coder import code_steps
from mrslam.spatial import Keyframes, KeyScans

BLOCK = 64
"""Keyframes in a block."""
UNITS = (1e3, 1e3, 1e4)
SCALE = np.array(UNITS)
"""Units per metre, metre, radian."""
STAMP_LIMIT_NS = 2**62
"""Bound of stamps, nanoseconds: 146 years."""
UNIT_MOST = 9
"""Stamps' steps are told in a power of ten of nanoseconds, this one at most."""
STEP_BYTES_MOST = 384
"""Room for a step that is written, bytes: each of its 280 decisions takes 10 bits at most."""
POSE_LIMIT = 2**30
"""Bound of a pose's numbers, mm and 0.1 mrad: some 1000 km."""


@dataclass(frozen=True, eq=False)
class KeyframeBlock:
    """Up to 64 keyframes and the map revision at which they last changed."""

    revision: int
    stamps_ns: NDArray[np.int64]
    """``(k,)``."""
    poses: NDArray[np.int32]
    """``(k, 3)``: x (mm), y (mm), theta (0.1 mrad)."""
    scans: KeyScans = field(default_factory=KeyScans.empty)
    """Of the k keyframes; empty where the map has no scans."""

    @property
    def content(self) -> bytes:
        """The bytes that hashes of the block are taken over; its revision is not among them."""
        sizes = np.array([self.stamps_ns.size, len(self.scans)], dtype="<i8").tobytes()
        poses = self.stamps_ns.astype("<i8").tobytes() + self.poses.astype("<i4").tobytes()
        return sizes + poses + scan_content(self.scans)

    @cached_property
    def packed_scans(self) -> bytes:
        """The scans as coded for an asker that holds none of them."""
        return pack_scans(self.scans, 0)

    def equals(self, other: KeyframeBlock) -> bool:
        """Return whether the content is the same."""
        same_poses = np.array_equal(self.stamps_ns, other.stamps_ns) and np.array_equal(self.poses, other.poses)
        return same_poses and self.scans.equals(other.scans)


def quantise(T_map_base: NDArray[np.float64]) -> NDArray[np.int32]:
    """Return poses ``(K, 3)`` as whole millimetres and tenths of a milliradian; NaN and infinity become 0."""
    scaled = np.nan_to_num(np.round(T_map_base * SCALE), nan=0.0, posinf=0.0, neginf=0.0)
    return np.clip(scaled, -POSE_LIMIT, POSE_LIMIT).astype(np.int32)


def quantise_pose(T_map_base: NDArray[np.float64]) -> tuple[int, int, int]:
    """Return one pose ``(3,)`` as :func:`quantise` does, as plain numbers: it runs at every scan."""
    whole = (value * unit for value, unit in zip(T_map_base.tolist(), UNITS, strict=True))
    x, y, theta = (min(max(round(value), -POSE_LIMIT), POSE_LIMIT) if math.isfinite(value) else 0 for value in whole)
    return x, y, theta


def to_blocks(
    keyframes: Keyframes, scans: KeyScans, before: tuple[KeyframeBlock, ...], revision: int
) -> tuple[KeyframeBlock, ...]:
    """Return the keyframes in blocks; one that equals that of ``before`` is the same object, with its revision."""
    stamps, poses = np.asarray(keyframes.stamps_ns, dtype=np.int64), quantise(keyframes.T_map_base)
    blocks = []
    for i, start in enumerate(range(0, stamps.size, BLOCK)):
        end = min(start + BLOCK, stamps.size)
        seen = scans.part(start, end) if len(scans) else scans
        block, old = KeyframeBlock(revision, stamps[start:end], poses[start:end], seen), None
        if i < len(before):
            old = before[i]
        blocks.append(old if old is not None and old.equals(block) else _owned(block, old))
    return tuple(blocks)


def _owned(block: KeyframeBlock, old: KeyframeBlock | None) -> KeyframeBlock:
    """Return the block in memory of its own, or of the one before it where the scans are the same."""
    kept = old.scans if old is not None and old.scans.equals(block.scans) else block.scans.copy()
    return KeyframeBlock(block.revision, block.stamps_ns.copy(), block.poses.copy(), kept)


def to_keyframes(blocks: tuple[KeyframeBlock, ...]) -> Keyframes:
    """Return the keyframes of all blocks in order."""
    if not blocks:
        return Keyframes.empty()
    stamps = np.concatenate([block.stamps_ns for block in blocks])
    poses = np.concatenate([block.poses for block in blocks]) / SCALE
    stamps.flags.writeable = poses.flags.writeable = False
    return Keyframes(stamps, poses)


def to_key_scans(blocks: tuple[KeyframeBlock, ...]) -> KeyScans:
    """Return the scans of all blocks in order; blank ones for a block without, if another has some."""
    if not any(len(block.scans) for block in blocks):
        return KeyScans.empty()
    return KeyScans.concatenate(
        block.scans if len(block.scans) else KeyScans.blank(block.stamps_ns.size) for block in blocks
    )


def _columns(block: KeyframeBlock | None, count: int) -> NDArray[np.int64]:
    """Return stamps and poses as ``(count, 4) int64``, cut or padded by repeating the last row."""
    if block is None or block.stamps_ns.size == 0:
        return np.zeros((count, 4), dtype=np.int64)
    rows = np.concatenate([block.stamps_ns[:, None], block.poses.astype(np.int64)], axis=1)[:count]
    return np.concatenate([rows, np.repeat(rows[-1:], count - rows.shape[0], axis=0)])


def pack_block(block: KeyframeBlock, base: KeyframeBlock | None) -> bytes:
    """Return the block coded against the asker's: steps of differences from its poses, and new scans."""
    count = block.stamps_ns.size
    known = 0 if base is None else _common(block.scans, base.scans)
    new, body = len(block.scans) - known, b""
    if new:
        body = pack_scans(block.scans, known) if known else block.packed_scans
    sizes = np.array([known, new, len(body)], dtype=np.int64)
    return bytes([count]) + _pack_steps(block, base) + varints(sizes) + body


def _pack_steps(block: KeyframeBlock, base: KeyframeBlock | None) -> bytes:
    """Return stamps and poses as the steps of their differences from the asker's, and the unit of the stamps' steps."""
    count = block.stamps_ns.size
    steps = np.diff(_columns(block, count) - _columns(base, count), axis=0, prepend=0)
    unit = 0
    while unit < UNIT_MOST and not (steps[:, 0] % 10 ** (unit + 1)).any():
        unit += 1
    steps[:, 0] //= 10**unit
    trained = _trained(base, unit)
    room = np.empty(STEP_BYTES_MOST * (count + 1), dtype=np.uint8)
    used = code_steps(trained, steps, _kept(base, count), room, True)
    return bytes([unit]) + varints(np.array([used], dtype=np.int64)) + room[:used].tobytes()


def _unpack_steps(raw: bytes, at: int, base: KeyframeBlock | None, count: int) -> tuple[NDArray[np.int64], int]:
    """Return stamps and poses ``(count, 4)``, and the position after them."""
    unit = raw[at] if at < len(raw) else UNIT_MOST + 1
    if unit > UNIT_MOST:
        raise WireError("bad keyframes", "unit")
    (size,), at = _sizes(raw, at + 1, 1)
    if not 0 < size <= len(raw) - at:
        raise WireError("bad keyframes", "steps")
    steps, coded = np.zeros((count, 4), dtype=np.int64), np.frombuffer(bytearray(raw[at : at + size]), dtype=np.uint8)
    if code_steps(_trained(base, unit), steps, _kept(base, count), coded, False) != size + READ_AHEAD:
        raise WireError("bad keyframes", "steps")
    with np.errstate(over="ignore"):
        steps[:, 0] *= 10**unit
        return np.cumsum(steps, axis=0) + _columns(base, count), at + size


def _kept(base: KeyframeBlock | None, count: int) -> int:
    return 0 if base is None else min(base.stamps_ns.size, count)


def _trained(base: KeyframeBlock | None, unit: int) -> NDArray[np.int64]:
    """Return the steps ``(k, 4)`` of the asker's block: what new ones are like."""
    if base is None:
        return np.empty((0, 4), dtype=np.int64)
    steps = np.diff(_columns(base, base.stamps_ns.size), axis=0)
    steps[:, 0] //= 10**unit
    return steps


def _common(scans: KeyScans, held: KeyScans) -> int:
    """Return how many scans an asker holds already: a keyframe's scan is fixed for an epoch; 0 where they differ."""
    return len(held) if len(held) <= len(scans) and scans.part(0, len(held)).equals(held) else 0


def unpack_block(raw: bytes, base: KeyframeBlock | None, revision: int) -> tuple[KeyframeBlock, int]:
    """Return a map's keyframe block, and how many bytes it took; ``base``: the block held, if any.

    Raises :class:`WireError` where it is cut off or out of range.
    """
    count = raw[0] if raw else 0
    if not 0 < count <= BLOCK:
        raise WireError("bad keyframes", "count")
    rows, at = _unpack_steps(raw, 1, base, count)
    if not (_within(rows[:, 1:], POSE_LIMIT) and _within(rows[:, 0], STAMP_LIMIT_NS)):
        raise WireError("bad keyframes", "out of range")
    (known, new, size), at = _sizes(raw, at, 3)
    held = KeyScans.empty() if base is None else base.scans
    if not 0 <= known <= len(held) or new < 0 or known + new not in (0, count) or not 0 <= size <= len(raw) - at:
        raise WireError("bad keyframes", "number of scans")
    scans = held if known == len(held) else held.part(0, known)
    if new:
        scans = scans.append(unpack_scans(raw[at : at + size], scans, new))
    return KeyframeBlock(revision, rows[:, 0].copy(), rows[:, 1:].astype(np.int32), scans), at + size


def _within(values: NDArray[np.int64], limit: int) -> bool:
    """Return whether no value is beyond the limit; the least integer has no absolute value."""
    return bool(((-limit <= values) & (values <= limit)).all())


def _sizes(raw: bytes, at: int, count: int) -> tuple[list[int], int]:
    values, at = read_varints(raw, at, count)
    return values.tolist(), at


def varints(values: NDArray[np.int64]) -> bytes:
    """Return signed numbers as zigzag LEB128, 7 bits a byte."""
    out = bytearray()
    for value in values.tolist():
        rest = value << 1 if value >= 0 else (-value << 1) - 1
        while rest > 127:
            out.append(rest & 127 | 128)
            rest >>= 7
        out.append(rest)
    return bytes(out)


def read_varints(raw: bytes, start: int, count: int) -> tuple[NDArray[np.int64], int]:
    """Return ``count`` numbers read from ``start`` and the position after them; at most nine bytes each."""
    values, at = [], start
    for _ in range(count):
        value = shift = 0
        while True:
            if at >= len(raw) or shift > 63:
                raise WireError("bad keyframes", "varint")
            byte = raw[at]
            at += 1
            value |= (byte & 127) << shift
            if byte < 128:
                break
            shift += 7
        value = value >> 1 if value & 1 == 0 else -((value + 1) >> 1)
        if not -(2**63) <= value < 2**63:
            raise WireError("bad keyframes", "varint")
        values.append(value)
    return np.array(values, dtype=np.int64), at
