"""The messages, typed and bounded. docs/protocol.md describes each byte."""

from __future__ import annotations

from typing import Annotated

import msgspec

from mrslam.comms.wire.frames import WireError, frame, unframe

Name = Annotated[str, msgspec.Meta(min_length=1, max_length=64, pattern=r"^[A-Za-z0-9_.-]+$")]
Percent = Annotated[int, msgspec.Meta(ge=0, le=100)]
U32 = Annotated[int, msgspec.Meta(ge=0, le=2**32 - 1)]
Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
I32 = Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31 - 1)]
Milliseconds = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
TileCoordinate = Annotated[int, msgspec.Meta(ge=-(2**20), le=2**20)]
MAX_LIST = 65_536

Version = tuple[int, int]
"""(epoch, revision): a newer epoch beats any revision of an older one."""


class Message(msgspec.Struct, array_like=True, frozen=True, tag_field="k"):
    """What all messages share: who sends it."""

    sender: Name


class Beacon(Message, frozen=True, tag=1):
    """I am here; I hear you this well; I stand there."""

    boot: Count
    seq: Count
    uptime_ms: Milliseconds
    """When it was sent, on the sender's clock since its start."""
    period_ms: Annotated[int, msgspec.Meta(ge=1, le=10**9)]
    mode: Annotated[int, msgspec.Meta(ge=0, le=2)]
    heard: Annotated[list[tuple[Name, Percent]], msgspec.Meta(max_length=64)]
    bumps: Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]
    """Epoch of the sender's map - boot; below 0 for a map that goes on from an earlier start."""
    pose: tuple[I32, I32, I32, Milliseconds] | None
    """x (mm), y (mm), theta (0.1 mrad), age (ms)."""


Digest = Annotated[list[tuple[Name, Count, Count]], msgspec.Meta(max_length=4096)]
"""(robot, epoch, revision), by robot."""


class Open(Message, frozen=True, tag=2):
    """Let us exchange. This is what I hold, and which snapshots I hold in part."""

    boot: Count
    xid: U32
    digest: Digest
    staged: Digest


class Accept(Message, frozen=True, tag=3):
    """Yes; this is what I hold."""

    boot: Count
    xid: U32
    digest: Digest
    staged: Digest


class Refuse(Message, frozen=True, tag=4):
    """Not now."""

    xid: U32
    reason: Annotated[str, msgspec.Meta(max_length=64)]


class Ask(Message, frozen=True, tag=5):
    """Tell what I lack of this robot's map, if I hold this version."""

    xid: U32
    robot: Name
    epoch: Count
    base: Count


class Manifest(Message, frozen=True, tag=6):
    """What differs between the asker's version and the target, most valuable first."""

    xid: U32
    robot: Name
    epoch: Count
    base: Count
    target: Count
    resolution_m: Annotated[float, msgspec.Meta(ge=1e-3, le=100.0)]
    keyframes: Count
    blocks: Annotated[list[U32], msgspec.Meta(max_length=MAX_LIST)]
    block_ages: Annotated[list[Count], msgspec.Meta(max_length=MAX_LIST)]
    """target - revision, for each block."""
    rows: Annotated[list[TileCoordinate], msgspec.Meta(max_length=MAX_LIST)]
    cols: Annotated[list[TileCoordinate], msgspec.Meta(max_length=MAX_LIST)]
    ages: Annotated[list[Count], msgspec.Meta(max_length=MAX_LIST)]
    """target - revision, for each tile."""


class SignedManifest(Manifest, frozen=True, tag=11):
    """A manifest with the proof, by the map's own robot, of what the target is."""

    root: Annotated[bytes, msgspec.Meta(min_length=16, max_length=16)]
    """Hash of the whole target, see :meth:`mrslam.comms.maps.seal.MapSeal.root_of`."""
    signature: Annotated[bytes, msgspec.Meta(max_length=80)]
    certificate: Annotated[bytes, msgspec.Meta(max_length=2048)]
    """The signer's, DER."""


class Get(Message, frozen=True, tag=7):
    """Send these items of the manifest (bit i of the mask: tile i; after the tiles the keyframe blocks)."""

    xid: U32
    robot: Name
    epoch: Count
    base: Count
    target: Count
    mask: Annotated[bytes, msgspec.Meta(max_length=2 * MAX_LIST // 8)]


class Chunk(Message, frozen=True, tag=8):
    """Some items of a manifest."""

    xid: U32
    robot: Name
    epoch: Count
    base: Count
    target: Count
    mask: Annotated[bytes, msgspec.Meta(max_length=2 * MAX_LIST // 8)]
    is_delta: bool
    """Whether items are coded as differences from the asker's base."""
    raw_bytes: Annotated[int, msgspec.Meta(ge=0, le=1 << 20)]
    """Size of ``packed`` when decompressed."""
    packed: bytes
    content_hash: Annotated[bytes, msgspec.Meta(min_length=8, max_length=8)]


HOLD_ALL, GIVE_NO_MORE, LONG_DONE = 0, 1, 2


class Done(Message, frozen=True, tag=9):
    """I hold what I wanted (0); I give no more now (1); it is over here and I held all (2, never answered)."""

    xid: U32
    code: Annotated[int, msgspec.Meta(ge=HOLD_ALL, le=LONG_DONE)]


class Bye(Message, frozen=True, tag=10):
    """I leave."""

    boot: Count


Words = Annotated[str, msgspec.Meta(max_length=120)]
Bytes = Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]


class LinkRow(msgspec.Struct, array_like=True, frozen=True):
    """One teammate, as the sender of a :class:`Status` sees it."""

    peer: Name
    quality: Percent
    lq: Percent
    strong: bool
    activity: Words
    next_ms: Milliseconds | None
    """Until the next exchange; nil: none is due."""
    sent: Bytes
    received: Bytes
    saved: Bytes
    """What whole maps as LZ4 would have cost beyond what was sent."""


class Status(Message, frozen=True, tag=12):
    """How a robot fares, for those who watch; robots do not listen to it."""

    boot: Count
    uptime_ms: Milliseconds
    mode: Annotated[int, msgspec.Meta(ge=0, le=2)]
    beacon_bytes: Count
    """Bytes of beacons sent since the start."""
    other_bytes: Count
    """Bytes of all else sent since the start, but of statuses."""
    links: Annotated[list[LinkRow], msgspec.Meta(max_length=64)]
    digest: Digest
    """The maps it holds."""
    alignments: Annotated[list[tuple[Name, Name, Words]], msgspec.Meta(max_length=64)]
    """Pairs of maps and what is believed of them."""


AnyMessage = Beacon | Open | Accept | Refuse | Ask | Manifest | Get | Chunk | Done | Bye | SignedManifest | Status

_encoder = msgspec.msgpack.Encoder()
_decoder = msgspec.msgpack.Decoder(AnyMessage)


def encode(message: Message, tag: int) -> bytes:
    """Return the message framed for a team."""
    return frame(_encoder.encode(message), tag)


def decode(payload: bytes, tag: int, max_bytes: int) -> AnyMessage:
    """Return the message, or raise :class:`mrslam.comms.wire.frames.WireError`; nothing else is ever raised."""
    body = unframe(payload, tag, max_bytes)
    try:
        message: AnyMessage = _decoder.decode(body)
    except (msgspec.DecodeError, msgspec.ValidationError, UnicodeDecodeError, RecursionError) as error:
        raise WireError("malformed", str(error)) from error
    return message
