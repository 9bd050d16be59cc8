"""Tiles as bytes: palette, difference from what the asker holds, bit planes, LZ4.

Cells of one chunk hold few distinct values, so each cell becomes its index in the chunk's palette; XOR with the index of
the same cell in the asker's tile (all unknown where it has none) leaves mostly zeros; bit planes put those zeros side by
side, and LZ4 takes them out.
"""

from __future__ import annotations

import lz4.block
import numpy as np
from numpy.typing import NDArray

from comms.frames import WireError
from spatial import TILE_CELLS, UNKNOWN

CELLS = TILE_CELLS * TILE_CELLS
MAX_TILES_PER_CHUNK = 64


def pack_tiles(cells: NDArray[np.int8], base: NDArray[np.int8]) -> bytes:
    """Return tiles ``(N, 64, 64)`` coded against ``base`` of the same shape, not yet compressed."""
    present = np.zeros(256, dtype=np.bool_)
    present[cells.reshape(-1).view(np.uint8)] = True
    present[base.reshape(-1).view(np.uint8)] = True
    present[255] = True  # unknown is always in the palette, and its index is 0
    palette = np.flatnonzero(np.roll(present, 1)).astype(np.uint8)  # value + 1: 0 unknown, 1 .. 101
    index_of = np.zeros(256, dtype=np.uint8)
    index_of[palette] = np.arange(palette.size, dtype=np.uint8)
    index_of = np.roll(index_of, -1)
    changed = index_of[cells.view(np.uint8)] ^ index_of[base.view(np.uint8)]
    bits = max(int(palette.size - 1).bit_length(), 1)
    planes = np.packbits((changed.reshape(1, -1) >> np.arange(bits, dtype=np.uint8)[:, None]) & 1, axis=-1)
    return bytes([palette.size]) + palette.tobytes() + planes.tobytes()


def unpack_tiles(raw: bytes, base: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return the tiles ``(N, 64, 64)``; raise :class:`WireError` where the bytes do not fit ``base``'s N."""
    count = base.shape[0]
    size = raw[0] if raw else 0
    palette = np.frombuffer(raw, dtype=np.uint8, count=min(size, max(len(raw) - 1, 0)), offset=1 if raw else 0)
    if size == 0 or palette.size != size or palette[0] != 0 or palette[-1] > 101 or (np.diff(palette) <= 0).any():
        raise WireError("bad tiles", "palette")
    bits = max((size - 1).bit_length(), 1)
    if len(raw) != 1 + size + bits * count * CELLS // 8:
        raise WireError("bad tiles", f"{len(raw)} bytes for {count} tiles of {size} values")
    planes = np.frombuffer(raw, dtype=np.uint8, offset=1 + size).reshape(bits, -1)
    index = np.zeros(count * CELLS, dtype=np.uint8)
    for bit in range(bits):
        index |= np.unpackbits(planes[bit]) << np.uint8(bit)
    index_of = np.zeros(256, dtype=np.uint8)
    index_of[palette] = np.arange(size, dtype=np.uint8)
    index ^= np.roll(index_of, -1)[base.reshape(-1).view(np.uint8)]
    if int(index.max(initial=0)) >= size:
        raise WireError("bad tiles", "value outside the palette")
    return (palette.astype(np.int16) - 1).astype(np.int8)[index].reshape(count, TILE_CELLS, TILE_CELLS)


def max_packed(tiles: int, blocks: int) -> int:
    """Return the most bytes that a chunk of so many items can hold before compression."""
    return 512 + tiles * CELLS + blocks * 4096


def compress(raw: bytes) -> bytes:
    """Return LZ4 block data without a size in front."""
    return lz4.block.compress(raw, mode="high_compression", compression=9, store_size=False)


def decompress(packed: bytes, raw_bytes: int, bound: int) -> bytes:
    """Return exactly ``raw_bytes`` bytes, or raise :class:`WireError`; nothing above ``bound`` is ever allocated."""
    if raw_bytes > bound:
        raise WireError("oversized", f"{raw_bytes} bytes decompressed > {bound}")
    try:
        raw: bytes = lz4.block.decompress(packed, uncompressed_size=raw_bytes)
    except lz4.block.LZ4BlockError as error:
        raise WireError("corrupt", "LZ4") from error
    if len(raw) != raw_bytes:
        raise WireError("corrupt", "LZ4 length")
    return raw


def full_map_bytes(cells: NDArray[np.int8]) -> int:
    """Return what the whole grid costs as one LZ4 block, the way mrgs sends it."""
    return len(lz4.block.compress(np.ascontiguousarray(cells).tobytes(), store_size=False))


def unknown_tile() -> NDArray[np.int8]:
    """Return an all-unknown tile."""
    tile = np.full((TILE_CELLS, TILE_CELLS), UNKNOWN, dtype=np.int8)
    tile.flags.writeable = False
    return tile
