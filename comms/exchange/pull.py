"""The receiving side of one robot's map from one peer: what to ask for next, and what arrived."""

from __future__ import annotations

from dataclasses import dataclass, field

from mrslam.comms.config import CommsConfig
from mrslam.comms.maps.chunks import open_chunk
from mrslam.comms.maps.staged_maps import StagedMaps
from mrslam.comms.wire.bitmask import to_mask
from mrslam.comms.wire.messages import Chunk, Get, Manifest
from mrslam.spatial.tiles import TileIndex

Offer = tuple[str, int, int, int]
"""A manifest's robot, epoch, base and target."""


def offer_of(one: Manifest | Get | Chunk) -> Offer:
    """Return the key of a manifest, or of the one that a message refers to."""
    return one.robot, one.epoch, one.base, one.target


@dataclass
class Pull:
    """One robot's map being received from one peer."""

    robot: str
    manifest: Manifest | None = None
    asked: set[int] = field(default_factory=set)
    """Numbers of the manifest's items (tiles, then blocks) asked for and not here yet."""
    has_brought: bool = False
    """Whether any item has arrived."""


def next_get(pull: Pull, staged_maps: StagedMaps, sender: str, xid: int, config: CommsConfig) -> Get | None:
    """Return the request for the most valuable items not here yet, as many as may be on the way; None for nothing."""
    manifest = pull.manifest
    if manifest is None:
        return None
    tiles, blocks = staged_maps.missing(manifest)
    wanted = tiles + [len(manifest.rows) + k for k in blocks]
    pull.asked = set(wanted[: config.window_tiles])
    if not pull.asked:
        return None
    mask = to_mask(sorted(pull.asked))
    return Get(sender, xid, manifest.robot, manifest.epoch, manifest.base, manifest.target, mask)


def take_chunk(pull: Pull, chunk: Chunk, staged_maps: StagedMaps) -> list[TileIndex]:
    """Stage a chunk's content and return its tiles; raise :class:`WireError` where it does not hold what it says."""
    manifest = pull.manifest
    if manifest is None or offer_of(chunk) != offer_of(manifest):
        return []  # of a manifest that was replaced
    base = staged_maps.base_of(manifest)
    if base is None:
        return []
    blocks, tiles = open_chunk(chunk, manifest, base)
    staging = staged_maps.stage(manifest)
    staging.blocks.update(blocks)
    staging.tiles.update(tiles)
    where = zip(manifest.rows, manifest.cols, strict=True)
    here = {k for k, index in enumerate(where) if index in tiles}
    here |= {len(manifest.rows) + k for k, i in enumerate(manifest.blocks) if i in blocks}
    pull.asked -= here
    return list(tiles)
