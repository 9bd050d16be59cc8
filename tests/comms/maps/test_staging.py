"""Parts of a snapshot that arrive one by one, for one manifest and then for the next."""

from __future__ import annotations

import numpy as np

from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.maps.staging import Staging
from mrslam.comms.wire.keyframe_codec import KeyframeBlock
from mrslam.comms.wire.messages import Manifest
from mrslam.spatial import Tile, TiledMap
from mrslam.spatial.tiles import TILE_CELLS


def manifest(target: int, tiles: dict[tuple[int, int], int], blocks: dict[int, int], keyframes: int = 100) -> Manifest:
    """What leads to this revision: tiles by place and blocks by number, with the revision of each."""
    return Manifest(
        sender="b", xid=1, robot="a", epoch=1, base=0, target=target, resolution_m=0.05, keyframes=keyframes,
        blocks=list(blocks), block_ages=[target - revision for revision in blocks.values()],
        rows=[row for row, _ in tiles], cols=[col for _, col in tiles],
        ages=[target - revision for revision in tiles.values()],
    )  # fmt: skip


def tile(revision: int) -> Tile:
    return Tile(revision, np.full((TILE_CELLS, TILE_CELLS), 7, dtype=np.int8))


def block(revision: int) -> KeyframeBlock:
    return KeyframeBlock(revision, np.arange(3), np.zeros((3, 3), dtype=np.int32))


def test_what_has_not_arrived_in_its_revision_is_missing() -> None:
    staging, wanted = Staging(1), manifest(9, {(0, 0): 9, (0, 1): 4, (2, 2): 9}, {0: 9, 1: 5})
    staging.keep_for(wanted)
    assert staging.missing(wanted) == ([0, 1, 2], [0, 1])
    staging.tiles.update({(0, 1): tile(4), (2, 2): tile(8)})
    staging.blocks.update({0: block(8), 1: block(5)})
    assert staging.missing(wanted) == ([0, 2], [0])


def test_parts_that_the_next_manifest_does_not_name_are_dropped_and_the_others_stay() -> None:
    staging = Staging(1)
    staging.keep_for(manifest(9, {(0, 0): 9, (0, 1): 4}, {0: 9, 1: 5}))
    kept, kept_block = tile(4), block(5)
    staging.tiles.update({(0, 0): tile(9), (0, 1): kept})
    staging.blocks.update({0: block(9), 1: kept_block})
    following = manifest(12, {(0, 1): 4, (5, 5): 12}, {1: 5})
    staging.keep_for(following)
    assert staging.tiles == {(0, 1): kept} and staging.blocks == {1: kept_block} and staging.target == 12
    staging.tiles[(7, 7)] = tile(1)
    staging.keep_for(following)  # the same again asks nothing of what was gathered
    assert (7, 7) in staging.tiles


def test_a_whole_is_what_was_there_before_with_what_arrived_laid_on_it() -> None:
    old, new = {(0, 0): tile(1), (0, 1): tile(2)}, tile(5)
    blocks = tuple(block(k) for k in (1, 2, 3))
    base = Snapshot(1, TiledMap(0.05, old, 2), blocks, None)
    staging, wanted = Staging(1), manifest(5, {(0, 1): 5}, {1: 5}, keyframes=128)
    staging.keep_for(wanted)
    staging.tiles[(0, 1)], staging.blocks[1] = new, block(5)
    whole = staging.laid_on(base, wanted, None)
    assert whole.map.tiles == {(0, 0): old[0, 0], (0, 1): new} and whole.map.revision == 5
    assert whole.blocks == (blocks[0], staging.blocks[1])  # two blocks hold 128 keyframes
