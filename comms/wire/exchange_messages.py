"""Messages of an exchange of maps."""

from __future__ import annotations

from typing import Annotated

import msgspec

from mrslam.comms.wire.fields import MAX_LIST, U32, Count, Digest, MapName, Message, Name, SavedDigest, TileCoordinate


class Open(Message, frozen=True, tag=2):
    """Proposes an exchange, with the versions that the sender holds."""

    boot: Count
    xid: U32
    """Id of the exchange, chosen by who opens it."""
    digest: Digest
    """Versions held."""
    staged: Digest
    """Versions held in part."""
    saved: SavedDigest | None = None
    """Saved maps held; None, or left out by older programs: takes none."""
    unplaced: Annotated[list[Name], msgspec.Meta(max_length=4096)] | None = None
    """Robots whose maps the sender holds and has not placed; None, or left out by older programs: not said."""


class Accept(Message, frozen=True, tag=3):
    """Accepts an exchange; fields as in :class:`Open`."""

    boot: Count
    xid: U32
    digest: Digest
    staged: Digest
    saved: SavedDigest | None = None
    unplaced: Annotated[list[Name], msgspec.Meta(max_length=4096)] | None = None


class Refuse(Message, frozen=True, tag=4):
    """Refuses an exchange, or ends one that the sender does not know."""

    xid: U32
    reason: Annotated[str, msgspec.Meta(max_length=64)]


class Ask(Message, frozen=True, tag=5):
    """Asks for a manifest of what this robot's map has beyond version (epoch, base)."""

    xid: U32
    robot: MapName
    epoch: Count
    base: Count


class Manifest(Message, frozen=True, tag=6):
    """Lists the items (tiles, keyframe blocks) that differ between the asker's version and the target.

    Tiles come with the most news first, then by place; blocks by number.
    """

    xid: U32
    robot: MapName
    """Whose map it is, or which saved map."""
    epoch: Count
    base: Count
    """Revision that the asker holds; 0 for none of this epoch."""
    target: Count
    """Revision that the items lead to."""
    resolution_m: Annotated[float, msgspec.Meta(ge=1e-3, le=100.0)]
    """Edge of a cell, metres."""
    keyframes: Count
    """Keyframes of the whole target."""
    blocks: Annotated[list[U32], msgspec.Meta(max_length=MAX_LIST)]
    """Numbers of the blocks in the map."""
    block_ages: Annotated[list[Count], msgspec.Meta(max_length=MAX_LIST)]
    """target - revision, for each of ``blocks``."""
    rows: Annotated[list[TileCoordinate], msgspec.Meta(max_length=MAX_LIST)]
    cols: Annotated[list[TileCoordinate], msgspec.Meta(max_length=MAX_LIST)]
    """With ``rows``: the places of the tiles, in tiles."""
    ages: Annotated[list[Count], msgspec.Meta(max_length=MAX_LIST)]
    """target - revision, for each tile."""


class SignedManifest(Manifest, frozen=True, tag=11):
    """A manifest with the signature of the target by the map's own robot."""

    root: Annotated[bytes, msgspec.Meta(min_length=16, max_length=16)]
    """Hash of the whole target, see :meth:`mrslam.comms.maps.seal.MapSeal.root_of`."""
    signature: Annotated[bytes, msgspec.Meta(max_length=80)]
    certificate: Annotated[bytes, msgspec.Meta(max_length=2048)]
    """The signer's, DER; empty where the asker has it with its base."""


class Get(Message, frozen=True, tag=7):
    """Asks for items of a manifest (bit i of the mask: tile i; after the tiles the keyframe blocks)."""

    xid: U32
    robot: MapName
    epoch: Count
    base: Count
    target: Count
    mask: Annotated[bytes, msgspec.Meta(max_length=2 * MAX_LIST // 8)]


class Chunk(Message, frozen=True, tag=8):
    """Carries items of a manifest."""

    xid: U32
    robot: MapName
    epoch: Count
    base: Count
    target: Count
    mask: Annotated[bytes, msgspec.Meta(max_length=2 * MAX_LIST // 8)]
    is_delta: bool
    """Whether items are coded as differences from the asker's base."""
    raw_bytes: Annotated[int, msgspec.Meta(ge=0, le=1 << 20)]
    """Size of ``packed`` when decompressed."""
    packed: bytes
    """One LZ4 block."""
    content_hash: Annotated[bytes, msgspec.Meta(min_length=8, max_length=8)]


HOLD_ALL, GIVE_NO_MORE, ALREADY_OVER = 0, 1, 2
"""Codes of :class:`Done` (the format); the last is never answered."""


class Done(Message, frozen=True, tag=9):
    """Ends an exchange: the sender holds what it wanted (0), gives no more (1), or had completed it before (2)."""

    xid: U32
    code: Annotated[int, msgspec.Meta(ge=HOLD_ALL, le=ALREADY_OVER)]
