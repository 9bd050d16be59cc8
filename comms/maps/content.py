"""A chunk's content, decoded, and the hash that proves it."""

from __future__ import annotations

from hashlib import blake2b

import numpy as np
from numpy.typing import NDArray

from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.wire.bitmask import from_mask
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import KeyframeBlock, unpack_block
from mrslam.comms.wire.messages import Chunk, Manifest
from mrslam.comms.wire.tile_codec import MAX_TILES_PER_CHUNK, decompress, max_packed, unknown_tile, unpack_tiles
from mrslam.spatial import TILE_CELLS, Tile
from mrslam.spatial.tiles import TileIndex

UNKNOWN_TILE = unknown_tile()


def content_hash(
    manifest: Manifest, blocks: list[KeyframeBlock], tile_positions: list[int], cells: NDArray[np.int8]
) -> bytes:
    """Return eight bytes over what a chunk stands for, not how it was coded: a wrong base or place is found out too."""
    digest = blake2b(digest_size=8)
    for k in tile_positions:
        place = (manifest.rows[k], manifest.cols[k], manifest.target - manifest.ages[k])
        digest.update(np.array(place, dtype="<i8").tobytes())
    for block in blocks:
        digest.update(np.array(block.revision, dtype="<i8").tobytes())
        digest.update(block.stamps_ns.astype("<i8").tobytes() + block.poses.astype("<i4").tobytes())
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
