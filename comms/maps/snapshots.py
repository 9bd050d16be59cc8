"""Snapshots: one robot's map at one version, equal in every robot that holds it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mrslam.comms.wire.keyframe_codec import KeyframeBlock, to_blocks, to_key_scans, to_keyframes
from mrslam.comms.wire.messages import Version
from mrslam.comms.wire.tile_codec import unknown_tile
from mrslam.spatial import LocalMap, Tile, TiledMap


@dataclass(frozen=True)
class Proof:
    """A robot's signature of its own map at one version; ``comms/maps/seal.py`` makes and checks it."""

    root: bytes
    """Hash of everything in the snapshot."""
    signature: bytes
    """ECDSA over robot, version and root, DER."""
    certificate: bytes
    """The signer's, DER."""


@dataclass(frozen=True, eq=False)
class Snapshot:
    """A map, its keyframes, and the epoch (one life of the map) they belong to."""

    epoch: int
    map: TiledMap
    blocks: tuple[KeyframeBlock, ...]
    proof: Proof | None = None
    """Where the team has keys."""

    @property
    def version(self) -> Version:
        """(epoch, revision)."""
        return self.epoch, self.map.revision

    @property
    def local_map(self) -> LocalMap:
        """The same as a :class:`LocalMap`."""
        return LocalMap(self.map, to_keyframes(self.blocks), to_key_scans(self.blocks))

    @property
    def keyframes(self) -> int:
        """How many keyframes it holds."""
        return sum(block.stamps_ns.size for block in self.blocks)


def published(local_map: LocalMap, before: Snapshot | None, epoch: int) -> Snapshot | None:
    """Return the snapshot after ``before``; None where its revision is not newer.

    A tile that left the map is kept as an unknown one, so that others learn of it; one whose content changed under an
    old revision gets the new one.
    """
    new = local_map.map
    if before is not None and new.revision <= before.map.revision:
        return None
    old, last = ({}, 0) if before is None else (before.map.tiles, before.map.revision)
    tiles = {
        index: tile if tile is old.get(index) else _stamped(tile, old.get(index), last, new.revision)
        for index, tile in new.tiles.items()
    }
    for index in sorted(old.keys() - tiles.keys()):
        is_gone = bool((old[index].cells == -1).all())
        tiles[index] = old[index] if is_gone else Tile(new.revision, unknown_tile())
    held = before.blocks if before else ()
    blocks = to_blocks(local_map.keyframes, local_map.key_scans, held, new.revision)
    return Snapshot(epoch, TiledMap(new.resolution_m, tiles, new.revision), blocks)


def _stamped(tile: Tile, old: Tile | None, before: int, now: int) -> Tile:
    """Return the tile with the revision at which it last differed from what was published before."""
    if old is not None and old.revision == tile.revision:
        return tile
    if before < tile.revision <= now:
        return tile
    if old is not None and np.array_equal(old.cells, tile.cells):
        return old
    return Tile(now, tile.cells)


def relabelled(snapshot: Snapshot, epoch: int) -> Snapshot:
    """Return the same content under another epoch."""
    return Snapshot(epoch, snapshot.map, snapshot.blocks)


def value_of(tile: Tile, base: Tile | None) -> int:
    """Return how many cells of a tile differ from ``base``; without it, how many are known."""
    if base is None:
        return int(np.count_nonzero(tile.cells != -1))
    return int(np.count_nonzero(tile.cells != base.cells))
