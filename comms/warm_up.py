"""Compiles the kernels of tiles and keyframes, so that no exchange waits for it."""

from __future__ import annotations

import numpy as np

from mrslam.comms.wire.keyframe_codec import KeyframeBlock, pack_block, unpack_block
from mrslam.comms.wire.scan_codec import pack_scans, unpack_scans
from mrslam.comms.wire.tile_codec import pack_tiles, unknown_tile, unpack_tiles
from mrslam.spatial import KeyScans


def warm_up() -> None:
    """Call each kernel of the codecs of tiles and of keyframes and their scans once."""
    base = unknown_tile()[None]
    cells = np.zeros_like(base)
    assert np.array_equal(unpack_tiles(pack_tiles(cells, base), base), cells)
    points = np.stack([np.linspace(1.0, 3.0, 20), np.linspace(-1.0, 1.0, 20)], axis=1)
    scans = KeyScans.of_points([points, points], np.zeros((2, 2)))
    assert unpack_scans(pack_scans(scans, 1), scans.part(0, 1), 1).equals(scans.part(1, 2))
    block = KeyframeBlock(1, np.zeros(2, dtype=np.int64), np.zeros((2, 3), dtype=np.int32), scans)
    assert unpack_block(pack_block(block, block), block, 1)[0].equals(block)
