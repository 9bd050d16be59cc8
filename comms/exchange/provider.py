"""The giving side of an exchange: what the asker lacks, and the chunks that bring it. Keeps no state of its own."""

from __future__ import annotations

import numpy as np

from mrslam.comms.config import CommsConfig
from mrslam.comms.maps.content import content_hash
from mrslam.comms.maps.snapshots import Snapshot, value_of
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.bitmask import to_mask
from mrslam.comms.wire.keyframe_codec import pack_block
from mrslam.comms.wire.messages import Chunk, Manifest, SignedManifest, Version
from mrslam.comms.wire.tile_codec import MAX_TILES_PER_CHUNK, compress, pack_tiles, unknown_tile
from mrslam.spatial import TILE_CELLS, Tile

UNKNOWN_TILE = unknown_tile()


def manifest_for(
    store: MapStore, sender: str, xid: int, robot: str, held: Version, staged: Version | None
) -> Manifest | None:
    """Return what one who holds version ``held`` lacks of a robot's map, most valuable tiles first; None for nothing.

    ``staged``: the snapshot the asker has in part and wants to finish first, where it is still kept here.
    """
    target = store.newest(robot)
    if staged is not None and staged > held and (older := store.at(robot, *staged)) is not None:
        target = older
    if target is None or target.version <= held:
        return None
    base_revision = held[1] if held[0] == target.epoch else 0
    base = store.at(robot, target.epoch, base_revision) if base_revision else None
    if _replaces(target, base, base_revision):
        base_revision, base = 0, None
    store.remember(robot, target)
    old = {} if base is None else base.map.tiles
    changed = target.map.changed_since(base_revision)
    order = sorted(changed, key=lambda index: (-value_of(changed[index], old.get(index)), index))
    blocks = [i for i, block in enumerate(target.blocks) if block.revision > base_revision]
    revision = target.map.revision
    manifest = Manifest(
        sender,
        xid,
        robot,
        target.epoch,
        base_revision,
        revision,
        target.map.resolution_m,
        target.keyframes,
        blocks,
        [revision - target.blocks[i].revision for i in blocks],
        [row for row, _ in order],
        [col for _, col in order],
        [revision - changed[index].revision for index in order],
    )
    if target.proof is None:
        return manifest
    certificate = target.proof.certificate
    if base is not None and base.proof is not None and base.proof.certificate == certificate:
        certificate = b""  # the asker has it with what it holds
    fields = {name: getattr(manifest, name) for name in Manifest.__struct_fields__}
    return SignedManifest(**fields, root=target.proof.root, signature=target.proof.signature, certificate=certificate)


def _replaces(target: Snapshot, base: Snapshot | None, base_revision: int) -> bool:
    """Return whether nothing the asker holds stands any more: so it is after a robot took up an older state of itself.

    Then the asker may hold tiles that the target does not have at all, and differences would leave them in place.
    """
    if base is not None:
        return any(index not in target.map.tiles for index in base.map.tiles)
    return all(tile.revision > base_revision for tile in target.map.tiles.values())


def chunks_for(store: MapStore, manifest: Manifest, items: list[int], config: CommsConfig) -> list[Chunk]:
    """Return these items of a manifest as chunks, each below ``chunk_bytes``; none where the snapshot is gone."""
    target = store.at(manifest.robot, manifest.epoch, manifest.target)
    if target is None:
        return []
    base = store.at(manifest.robot, manifest.epoch, manifest.base) if manifest.base else None
    size = MAX_TILES_PER_CHUNK
    groups = [items[i : i + size] for i in range(0, len(items), size)]
    chunks: list[Chunk] = []
    while groups:
        group = groups.pop(0)
        chunk = _chunk(manifest, target, base, group)
        if len(chunk.packed) > config.chunk_bytes and len(group) > 1:
            groups[:0] = [group[: len(group) // 2], group[len(group) // 2 :]]
        else:
            chunks.append(chunk)
    return chunks


def _chunk(manifest: Manifest, target: Snapshot, base: Snapshot | None, items: list[int]) -> Chunk:
    count = len(manifest.rows)
    blocks = [manifest.blocks[k - count] for k in items if k >= count]
    indices = [(manifest.rows[k], manifest.cols[k]) for k in items if k < count]
    parts = [
        pack_block(target.blocks[i], base.blocks[i] if base is not None and i < len(base.blocks) else None)
        for i in blocks
    ]
    cells = np.empty((0, TILE_CELLS, TILE_CELLS), dtype=np.int8)
    if indices:
        old = {} if base is None else base.map.tiles
        cells = np.stack([target.map.tiles[index].cells for index in indices])
        parts.append(pack_tiles(cells, np.stack([_cells(old.get(index)) for index in indices])))
    raw = b"".join(parts)
    return Chunk(
        manifest.sender,
        manifest.xid,
        manifest.robot,
        manifest.epoch,
        manifest.base,
        manifest.target,
        to_mask(items),
        base is not None,
        len(raw),
        compress(raw),
        content_hash(manifest, [target.blocks[i] for i in blocks], [k for k in items if k < count], cells),
    )


def _cells(tile: Tile | None) -> np.ndarray[tuple[int, ...], np.dtype[np.int8]]:
    return UNKNOWN_TILE if tile is None else tile.cells
