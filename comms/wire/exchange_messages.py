"""Messages of an exchange of maps."""

from __future__ import annotations

from typing import Annotated

import msgspec

from mrslam.comms.wire.fields import MAX_LIST, U32, Count, Digest, Message, Name, TileCoordinate


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
