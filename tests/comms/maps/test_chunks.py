"""Chunks come back as what they were made of, and where anything of them does not fit nothing is taken."""

from __future__ import annotations

import msgspec
import numpy as np
import pytest

from mrslam.comms import CommsConfig
from mrslam.comms.maps import chunks
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.maps.store import NOTHING, MapStore
from mrslam.comms.wire.bitmask import to_mask
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.messages import Chunk, Manifest
from mrslam.comms.wire.tile_codec import MAX_TILES_PER_CHUNK, compress, decompress
from mrslam.spatial import TILE_CELLS, Keyframes, LocalMap, Tile, TiledMap
from tests.comms.team import big_map

CONFIG, NO_MAP = CommsConfig(), Snapshot(1000, TiledMap(0.05, {}, 0), ())


def offered(cells: int = 600, held: tuple[int, int] = NOTHING, seed: int = 0) -> tuple[MapStore, Manifest, Snapshot]:
    """Return a store with a map of two revisions, what one lacks who holds ``held``, and what that is."""
    store, first = MapStore("a", 1000, CONFIG), big_map(cells)
    store.publish(first)
    base = store.newest("a")
    assert make_manifest(store, "b", 6, "a", NOTHING, None)  # what was offered is kept, to send changes of it
    changed = sorted(first.map.tiles)[::3]  # of the keyframes the last block alone
    rng = np.random.default_rng(seed)
    noise = np.where(rng.random((TILE_CELLS, TILE_CELLS)) < 0.1, 100, 0).astype(np.int8)
    tiles = {index: Tile(2, np.roll(noise, rng.integers(TILE_CELLS))) for index in changed}
    way = first.keyframes
    moved = way.T_map_base + 0.01 * (way.stamps_ns >= way.stamps_ns[-3])[:, None]
    store.publish(LocalMap(TiledMap(0.05, {**first.map.tiles, **tiles}, 2), Keyframes(way.stamps_ns, moved)))
    manifest = make_manifest(store, "b", 7, "a", held, None)
    assert base is not None and manifest is not None
    return store, manifest, base if held[1] else NO_MAP


def everything(manifest: Manifest) -> list[int]:
    return list(range(len(manifest.rows) + len(manifest.blocks)))


@pytest.mark.parametrize("held", [NOTHING, (1000, 1)])
def test_all_of_a_map_comes_back_in_chunks_of_no_more_bytes_than_asked_for(held: tuple[int, int]) -> None:
    store, manifest, base = offered(held=held)
    target = store.newest("a")
    assert target is not None
    config = CommsConfig(chunk_bytes=1024)
    made = chunks.make_chunks(store, manifest, everything(manifest), config)
    alone = chunks.make_chunks(store, manifest, everything(manifest)[:1], config)
    assert len(made) > len(alone) == 1
    tiles, blocks, items = {}, {}, 0
    for chunk in made:
        some_blocks, some_tiles = chunks.open_chunk(chunk, manifest, base)
        assert len(chunk.packed) <= 1024 or len(some_blocks) + len(some_tiles) == 1
        assert all(not tile.cells.flags.writeable for tile in some_tiles.values())
        items += len(some_blocks) + len(some_tiles)
        blocks |= some_blocks
        tiles |= some_tiles
    assert items == len(everything(manifest)) and blocks.keys() == set(manifest.blocks)
    for index, tile in tiles.items():
        assert tile.revision == target.map.tiles[index].revision
        np.testing.assert_array_equal(tile.cells, target.map.tiles[index].cells)
    assert all(block.content == target.blocks[i].content for i, block in blocks.items())


def test_no_items_and_more_than_a_chunk_may_hold_are_refused() -> None:
    store, manifest, base = offered(1400)
    few = chunks.make_chunks(store, manifest, [0, 1], CONFIG)[0]
    assert len(manifest.rows) > MAX_TILES_PER_CHUNK
    for items in ([], list(range(MAX_TILES_PER_CHUNK + 1))):
        with pytest.raises(WireError, match=f"{len(items)} items"):
            chunks.open_chunk(msgspec.structs.replace(few, mask=to_mask(items)), manifest, base)


def repacked(chunk: Chunk, raw: bytes) -> Chunk:
    return msgspec.structs.replace(chunk, packed=compress(raw), raw_bytes=len(raw))


def test_bytes_left_over_are_refused() -> None:
    store, manifest, base = offered()
    block = chunks.make_chunks(store, manifest, [len(manifest.rows)], CONFIG)[0]
    raw = decompress(block.packed, block.raw_bytes, 1 << 20)
    assert chunks.open_chunk(repacked(block, raw), manifest, base)
    with pytest.raises(WireError, match="bytes left over"):
        chunks.open_chunk(repacked(block, raw + b"\0"), manifest, base)


def test_what_was_not_hashed_is_refused() -> None:
    """Other items of the same size, items said to be older than they are, and others than the base that is held."""
    store, manifest, base = offered(held=(1000, 1))
    tile, block = 0, len(manifest.rows)
    assert manifest.base == 1
    both = [chunks.make_chunks(store, manifest, [item], CONFIG)[0] for item in (tile, block)]
    for chunk in both:
        assert chunks.open_chunk(chunk, manifest, base)
    older = msgspec.structs.replace(manifest, ages=[age + 1 for age in manifest.ages])
    older_block = msgspec.structs.replace(manifest, block_ages=[1, *manifest.block_ages[1:]])
    for chunk, told in ((both[0], older), (both[1], older_block)):
        with pytest.raises(WireError, match="bad hash"):
            chunks.open_chunk(chunk, told, base)
    with pytest.raises(WireError):
        chunks.open_chunk(both[0], manifest, NO_MAP)  # differences from a map that is not held
    others = (offered(), offered(seed=1))
    whole, other = (chunks.make_chunks(store, full, [tile], CONFIG)[0] for store, full, _ in others)
    full = others[0][1]
    assert chunks.open_chunk(whole, full, NO_MAP) and whole.raw_bytes and other.content_hash != whole.content_hash
    for place in ({"rows": [row + 1 for row in full.rows]}, {"cols": [col + 1 for col in full.cols]}):
        with pytest.raises(WireError, match="bad hash"):
            chunks.open_chunk(whole, msgspec.structs.replace(full, **place), NO_MAP)
    with pytest.raises(WireError, match="bad hash"):
        chunks.open_chunk(msgspec.structs.replace(other, content_hash=whole.content_hash), full, NO_MAP)


def test_items_sent_whole_are_taken_as_they_are_whatever_is_held() -> None:
    """A sender that keeps the map held no longer sends no differences from it."""
    store, manifest, _ = offered()
    held = offered(held=(1000, 1))[2]
    for item in (0, len(manifest.rows)):
        chunk = chunks.make_chunks(store, manifest, [item], CONFIG)[0]
        assert not chunk.is_delta
        (blocks, tiles), (same_blocks, same_tiles) = (chunks.open_chunk(chunk, manifest, on) for on in (NO_MAP, held))
        assert [one.content for one in blocks.values()] == [one.content for one in same_blocks.values()]
        assert [one.cells.tobytes() for one in tiles.values()] == [one.cells.tobytes() for one in same_tiles.values()]
