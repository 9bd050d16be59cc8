"""Tiles as bytes: a palette, then the arithmetic code of what differs from the asker's tiles, then LZ4.

Cells of one chunk hold few distinct values, so each cell becomes its index in the chunk's palette, and is coded against
the same cell of the asker's tile (all unknown where it has none). Where that would need more room than bit planes do,
as for noise, bit planes are sent.
"""

from __future__ import annotations

import lz4.block
import numpy as np
from numpy.typing import NDArray

from mrslam.comms.wire.binary_coder import READ_AHEAD
from mrslam.comms.wire.cell_coder import code
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.lookup import look_up, mark_present
from mrslam.spatial import TILE_CELLS, UNKNOWN

CELLS = TILE_CELLS * TILE_CELLS
MAX_TILES_PER_CHUNK = 64
"""Items in a chunk, tiles and keyframe blocks (the format): bounds what a receiver decompresses at once to about 300 kB
of tiles; with blocks, the field ``raw_bytes`` bounds it to 1 MiB."""
HEAD_BYTES = 512
"""Room for the palette (at most 103 bytes) and the coder's last bytes, bytes."""
BLOCK_BYTES = 1 << 15
"""Bound of a block of 64 keyframes, bytes: of each, pose 40 at most, loop 110, scan 350 (measured: 195 for noise)."""
PLANES = 128
"""Added to the palette's size where bit planes follow it."""
TOP_VALUE = 101
"""Greatest palette entry: a cell's value + 1, so 0 is unknown and 101 is 100 percent."""


def pack_tiles(cells: NDArray[np.int8], base: NDArray[np.int8]) -> bytes:
    """Return tiles ``(N, 64, 64)`` coded against ``base`` of the same shape."""
    present = np.zeros(256, dtype=np.bool_)
    for array in (cells, base):
        mark_present(_bytes(array), present)
    present[255] = True  # unknown is always in the palette, and its index is 0
    palette = np.flatnonzero(np.roll(present, 1)).astype(np.uint8)
    index, held = _indices(palette, cells), _indices(palette, base)
    bits = _bits(palette.size)
    room = np.empty(bits * index.size // 8, dtype=np.uint8)
    used = int(code(index, held, bits, room, True))
    if used <= room.size:
        return bytes([palette.size]) + palette.tobytes() + room[:used].tobytes()
    planes = np.packbits((index.reshape(1, -1) >> np.arange(bits, dtype=np.uint8)[:, None]) & 1, axis=-1)
    return bytes([PLANES + palette.size]) + palette.tobytes() + planes.tobytes()


def unpack_tiles(raw: bytes, base: NDArray[np.int8]) -> NDArray[np.int8]:
    """Return the tiles ``(N, 64, 64)``; raise :class:`WireError` where the bytes make no sense for ``base``'s N."""
    kind = raw[0] if raw else 0
    size = kind % PLANES
    palette = np.frombuffer(raw[1 : 1 + size], dtype=np.uint8)
    if size == 0 or palette.size != size or palette[0] != 0 or palette[-1] > TOP_VALUE or not _rises(palette):
        raise WireError("bad tiles", "palette")
    bits = _bits(size)
    body = np.frombuffer(bytearray(raw[1 + size :]), dtype=np.uint8)
    if kind < PLANES:
        index = np.empty(base.shape, dtype=np.uint8)
        if code(index, _indices(palette, base), bits, body, False) != body.size + READ_AHEAD:
            raise WireError("bad tiles", "length")
    else:
        if body.size != bits * base.size // 8:
            raise WireError("bad tiles", f"{body.size} bytes of bit planes for {base.shape[0]} tiles")
        planes = np.unpackbits(body.reshape(bits, -1), axis=-1)
        index = (planes << np.arange(bits, dtype=np.uint8)[:, None]).sum(axis=0, dtype=np.uint8).reshape(base.shape)
    value_of = np.zeros(256, dtype=np.uint8)
    value_of[:size] = palette - np.uint8(1)  # 0 becomes 255, the byte of unknown
    cells = np.empty_like(index)
    if look_up(value_of, index, cells) >= size:
        raise WireError("bad tiles", "value outside the palette")
    return cells.view(np.int8)


def _bits(values: int) -> int:
    return max((values - 1).bit_length(), 1)


def _rises(palette: NDArray[np.uint8]) -> bool:
    return bool((palette[1:] > palette[:-1]).all())


def _bytes(cells: NDArray[np.int8]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(cells).view(np.uint8)


def _indices(palette: NDArray[np.uint8], cells: NDArray[np.int8]) -> NDArray[np.uint8]:
    """Return each cell's palette index; 0 where its value is not in the palette."""
    index_of = np.zeros(256, dtype=np.uint8)
    index_of[palette - np.uint8(1)] = np.arange(palette.size, dtype=np.uint8)
    index = np.empty(cells.shape, dtype=np.uint8)
    look_up(index_of, _bytes(cells), index)
    return index


def max_packed(tiles: int, blocks: int) -> int:
    """Return the most bytes that a chunk of this many items can hold before compression."""
    return HEAD_BYTES + tiles * CELLS + blocks * BLOCK_BYTES


def compress(raw: bytes) -> bytes:
    """Return LZ4 block data without a size in front."""
    return lz4.block.compress(raw, store_size=False)


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


def lz4_bytes(cells: NDArray[np.int8]) -> int:
    """Return the size of cells ``(H, W)`` as one LZ4 block, bytes."""
    return len(lz4.block.compress(np.ascontiguousarray(cells).tobytes(), store_size=False))


def unknown_tile() -> NDArray[np.int8]:
    """Return an all-unknown tile."""
    tile = np.full((TILE_CELLS, TILE_CELLS), UNKNOWN, dtype=np.int8)
    tile.flags.writeable = False
    return tile
