"""Chunks: items of a manifest as bytes, made and opened, with a hash over their content.

Throughout, ``k`` is a position in a list of the manifest, and ``i`` the number of a keyframe block in the map.
"""

from __future__ import annotations

from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from mrslam.comms.config import CommsConfig
from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.bitmask import from_mask, to_mask
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import KeyframeBlock, pack_block, unpack_block
from mrslam.comms.wire.messages import Chunk, Manifest
from mrslam.comms.wire.tile_codec import (
    MAX_TILES_PER_CHUNK,
    compress,
    decompress,
    max_packed,
    pack_tiles,
    unknown_tile,
    unpack_tiles,
)
from mrslam.spatial import TILE_CELLS, Tile
from mrslam.spatial.tiles import TileIndex

UNKNOWN_TILE = unknown_tile()


def content_hash(
    manifest: Manifest, blocks: list[KeyframeBlock], tile_positions: list[int], cells: NDArray[np.int8]
) -> bytes:
    """Return BLAKE2b-64 over a chunk's decoded content, so that a wrong base or place is noticed too.

    ``tile_positions``: of the tiles in the manifest's lists; ``cells``: ``(len(tile_positions), 64, 64)``.
    """
    digest = blake2b(digest_size=8)
    for k in tile_positions:
        place = (manifest.rows[k], manifest.cols[k], manifest.target - manifest.ages[k])
        digest.update(np.array(place, dtype="<i8").tobytes())
    for block in blocks:
        digest.update(np.array(block.revision, dtype="<i8").tobytes() + block.content)
    digest.update(np.ascontiguousarray(cells).tobytes())
    return digest.digest()


def open_chunk(
    chunk: Chunk, manifest: Manifest, base: Snapshot
) -> tuple[dict[int, KeyframeBlock], dict[TileIndex, Tile]]:
    """Return the keyframe blocks and tiles of a chunk; raise :class:`WireError` where anything does not fit."""
    items = from_mask(chunk.mask, len(manifest.rows) + len(manifest.blocks))
    if not items or len(items) > MAX_TILES_PER_CHUNK:
        raise WireError("bad chunk", f"{len(items)} items")
    count = len(manifest.rows)
    tile_positions = [k for k in items if k < count]
    positions = [k - count for k in items if k >= count]
    raw = decompress(chunk.packed, chunk.raw_bytes, max_packed(len(tile_positions), len(positions)))
    blocks: dict[int, KeyframeBlock] = {}
    for k in positions:
        i = manifest.blocks[k]
        old = base.blocks[i] if chunk.is_delta and i < len(base.blocks) else None
        blocks[i], used = unpack_block(raw, old, manifest.target - manifest.block_ages[k])
        raw = raw[used:]
    indices = [(manifest.rows[k], manifest.cols[k]) for k in tile_positions]
    cells = np.empty((0, TILE_CELLS, TILE_CELLS), dtype=np.int8)
    if indices:
        held = base.map.tiles if chunk.is_delta else {}
        old_cells = [held[index].cells if index in held else UNKNOWN_TILE for index in indices]
        cells = unpack_tiles(raw, np.stack(old_cells))
    elif raw:
        raise WireError("bad chunk", "bytes left over")
    if content_hash(manifest, list(blocks.values()), tile_positions, cells) != chunk.content_hash:
        raise WireError("bad hash")
    tiles: dict[TileIndex, Tile] = {}
    for k, index, tile_cells in zip(tile_positions, indices, cells, strict=True):
        own = tile_cells.copy()
        own.flags.writeable = False
        tiles[index] = Tile(manifest.target - manifest.ages[k], own)
    return blocks, tiles


def make_chunks(store: MapStore, manifest: Manifest, items: list[int], config: CommsConfig) -> list[Chunk]:
    """Return these items of a manifest as chunks, each below ``chunk_bytes``; none where the target is not kept."""
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


def _cells(tile: Tile | None) -> NDArray[np.int8]:
    return UNKNOWN_TILE if tile is None else tile.cells
