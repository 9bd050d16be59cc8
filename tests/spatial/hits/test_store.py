from __future__ import annotations

import copy

import numpy as np
import pytest

from mrslam.spatial.hits.cells import TILE
from mrslam.spatial.hits.drawing import insert_scan
from mrslam.spatial.hits.store import GROWTH_TILES, TileStore
from mrslam.spatial.hits.views import NO_ENDS, Beams

ORIGIN = np.zeros(2)


def points(*xy: tuple[float, float]) -> np.ndarray:
    return np.array([[x, y, 0.0, -1.0, 1.0] for x, y in xy])


def write(store: TileStore, index: int, pose: tuple[float, float, float], pts: np.ndarray) -> None:
    T = np.array(pose)
    store.cover(T[:2] - 20.0, T[:2] + 20.0)
    store.draw(index, ORIGIN[None], T[None], [pts], 0.0)


def insert(store: TileStore, index: int, pose: np.ndarray, pts: np.ndarray) -> None:
    insert_scan(store.tiles(index), store.refs, Beams(ORIGIN, pts, NO_ENDS), pose, 0.0)


def content(store: TileStore, index: int) -> dict[tuple[int, int], bytes]:
    rows, cols = np.nonzero(store.tables[index])
    return {
        (int(r) + store.row0, int(c) + store.col0): store.pool[store.tables[index, r, c]].tobytes()
        for r, c in zip(rows, cols, strict=True)
    }


def recount(store: TileStore) -> None:
    counts = np.bincount(store.tables.ravel(), minlength=store.refs.size)
    assert (counts[1:] == store.refs[1:]).all()
    assert store.tiles_used == np.count_nonzero(store.refs[1:])
    free = store.free[: store.free_count]
    assert np.unique(free).size == free.size and (store.refs[free] == 0).all() and 0 not in free
    assert not store.pool[0].any()


def test_children_of_one_parent_do_not_write_into_each_other() -> None:
    store = TileStore(3, 0.05)
    write(store, 0, (0, 0, 0), points((2, 0), (0, 3)))
    store.resample(np.zeros(3, dtype=np.int64))
    recount(store)
    before = content(store, 0)
    assert content(store, 1) == before == content(store, 2)
    write(store, 1, (0.1, 0, 0), points((2, 0.1), (-1, 1)))
    recount(store)
    assert content(store, 0) == before and content(store, 2) == before
    assert content(store, 1) != before


def test_memory_of_the_dead_returns() -> None:
    store = TileStore(4, 0.05)
    for i in range(4):
        write(store, i, (4.0 * i, 0, 0), points((5, 0), (0, 5), (-5, 0)))
    used = store.tiles_used
    store.resample(np.full(4, 2, dtype=np.int64))
    recount(store)
    assert store.tiles_used < used / 2
    for i in range(4):
        store.clear(i)
    recount(store)
    assert store.tiles_used == 0


def test_pool_shrinks_and_keeps_its_content() -> None:
    store = TileStore(2, 0.05)
    for k in range(60):
        write(store, 1, (15.0 * k, 0, 0), points((10, 3), (-10, 3), (0, 12)))
    write(store, 0, (0, 0, 0), points((2, 1)))
    size, before, stamped = store.refs.size, content(store, 0), stamps(store, 0)
    store.pool.resize((max(size, 5000), 1024), refcheck=False)
    grown = store.pool.shape[0] - size
    store.refs = np.concatenate([store.refs, np.zeros(grown, dtype=np.int32)])
    store.stamps = np.concatenate([store.stamps, np.zeros(grown, dtype=np.int64)])
    free = np.arange(size, size + grown, dtype=np.int32)
    store.free = np.concatenate([store.free[: store.free_count], free, np.zeros(size, dtype=np.int32)])
    store.free_count += grown
    store.resample(np.zeros(2, dtype=np.int64))
    recount(store)
    assert store.refs.size < 4096
    assert content(store, 0) == before == content(store, 1)
    assert stamps(store, 0) == stamped == stamps(store, 1)


def stamps(store: TileStore, index: int) -> dict[tuple[int, int], int]:
    table = store.stamps_of(index)
    return {(r, c): int(table[r - store.row0, c - store.col0]) for r, c in content(store, index)}


def test_a_stamp_changes_where_its_tile_does_and_nowhere_else() -> None:
    store = TileStore(2, 0.05)
    write(store, 0, (0, 0, 0), points((2, 0), (0, 3)))
    first = content(store, 0), stamps(store, 0)
    write(store, 0, (0.1, 0, 0), points((5, 0), (0, 0.2)))  # some tiles of before, and new ones
    second = content(store, 0), stamps(store, 0)
    assert first[1].keys() < second[1].keys() and min(first[1].values()) > 0
    changed = {at for at in second[0] if first[0].get(at) != second[0][at]}
    assert {at for at in second[1] if first[1].get(at) != second[1][at]} == changed
    assert first[1].keys() & changed and first[1].keys() - changed
    store.resample(np.zeros(2, dtype=np.int64))  # from here on both maps share all tiles
    write(store, 1, (0, 0, 0), points((0, 3)))
    assert stamps(store, 0) == second[1]
    mine = {at for at in content(store, 1) if content(store, 1)[at] != second[0].get(at)}
    assert {at for at, stamp in stamps(store, 1).items() if stamp != second[1].get(at)} == mine != set()


def test_a_store_that_begins_again_holds_nothing_and_is_where_it_was_told() -> None:
    store = TileStore(2, 0.05)
    write(store, 0, (0, 0, 0), points((10, 3), (-10, 3)))
    write(store, 1, (40, 0, 0), points((2, 0)))
    store.restart(np.array([100.0, -60.0]))
    recount(store)
    assert store.tiles_used == 0
    box = np.array([98.0, -62.0]), np.array([102.0, -58.0])
    size = store.tables[0].size
    assert store.window_tiles(*box) == size
    write(store, 1, (100, -60, 0), points((2, 0)))
    recount(store)
    assert content(store, 1) and not content(store, 0)


def test_how_large_a_window_would_be_is_known_before_it_grows() -> None:
    store = TileStore(1, 0.05)
    for low, high in ((-5.0, 5.0), (-80.0, 5.0), (3.0, 170.0)):
        corners = np.array([low, -1.0]), np.array([high, 2.0])
        tiles = store.window_tiles(*corners)
        store.cover(*corners)
        assert store.tables[0].size == tiles


def test_growing_any_way_moves_nothing() -> None:
    store = TileStore(1, 0.05)
    write(store, 0, (0, 0, 0), points((2, 0), (0, 3)))
    before = content(store, 0)
    for corner in ((-90, 0), (0, -70), (60, 80)):
        store.cover(np.array(corner, dtype=float), np.array(corner, dtype=float))
        assert content(store, 0) == before
    recount(store)


def test_maps_owned_at_once_are_as_if_one_after_the_other_though_tiles_run_out_between() -> None:
    poses = np.array([[0.3 * i, 0.0, 0.2 * i] for i in range(5)])
    pts = points((9, 2), (0, 12), (-14, 3))
    stores = TileStore(5, 0.05, spare_tiles=30), TileStore(5, 0.05, spare_tiles=4000)
    for store in stores:
        store.cover(np.full(2, -30.0), np.full(2, 30.0))
        for i in range(5):
            insert(store, i, poses[i], pts)  # nothing is owned yet: no effect
    stores[0].own(0, Beams(ORIGIN, pts, NO_ENDS), poses, True)
    for i in range(5):
        stores[1].own(i, Beams(ORIGIN, pts, NO_ENDS), poses[i : i + 1], True)
    for store in stores:
        for i in range(5):
            insert(store, i, poses[i], pts)
        recount(store)
    assert stores[0].writes == stores[1].writes == 5
    for i in range(5):
        assert content(stores[0], i) == content(stores[1], i) != {}


def test_scans_drawn_at_once_are_as_if_one_after_the_other_though_tiles_run_out_between() -> None:
    poses = np.array([[2.0 * i, -1.5 * i, 0.7 * i] for i in range(5)])
    origins = np.array([[0.1 * i, 0.05] for i in range(5)])
    scans = [points((9, 2), (0, 12), *[(-14, 3)] * i).astype(np.float32) for i in range(5)]
    stores = TileStore(1, 0.05, spare_tiles=30), TileStore(1, 0.05, spare_tiles=4000)
    for store in stores:
        store.cover(np.full(2, -40.0), np.full(2, 40.0))
    stores[0].draw(0, origins, poses, scans, 0.1)
    for i in range(5):
        beams = Beams(origins[i], scans[i].astype(np.float64), NO_ENDS)
        stores[1].own(0, beams, poses[i : i + 1], True)
        insert_scan(stores[1].tiles(0), stores[1].refs, beams, poses[i], 0.1)
    assert content(stores[0], 0) == content(stores[1], 0) != {}
    assert stores[0].writes == stores[1].writes == 5
    for store in stores:
        recount(store)


def test_what_is_drawn_after_the_window_grew_is_as_if_it_had_been_large_from_the_start() -> None:
    grown, large = TileStore(1, 0.05), TileStore(1, 0.05)
    large.cover(np.full(2, -60.0), np.full(2, 60.0))
    for x, y in ((0.0, 0.0), (-40.0, 3.0), (1.0, 40.0), (0.0, -45.0)):
        for store in (grown, large):
            write(store, 0, (x, y, 0.3), points((9, 2), (0, 12), (-14, 3)))
    assert content(grown, 0) == content(large, 0)
    for store in (grown, large):
        recount(store)


@pytest.mark.parametrize("corner", [(-1, 0), (0, -1), (1, 0), (0, 1)])
@pytest.mark.parametrize("off_m", [-0.3, 0.3])
def test_a_tile_to_spare_lies_around_what_the_window_covers(corner: tuple[int, int], off_m: float) -> None:
    """What reads a map looks at the tiles around a point's own without asking whether they are in the window."""
    edge_m = TILE * 0.05
    for tiles in (GROWTH_TILES - 1, GROWTH_TILES, GROWTH_TILES + 1):
        store = TileStore(1, 0.05)
        at = np.array(corner) * tiles * edge_m + off_m
        store.cover(at, at)
        col, row = np.floor(at / edge_m).astype(int)
        rows, cols = store.tables.shape[1:]
        assert 1 <= row - store.row0 < rows - 1 and 1 <= col - store.col0 < cols - 1


def test_hits_far_outside_of_the_window_widen_it() -> None:
    store = TileStore(1, 0.05)
    store.add_points(0, np.array([70.0, -50.0, 0.0]), points((2, 0)))
    assert set(content(store, 0)) == {(-50 * 20 // TILE, 72 * 20 // TILE)}


def test_a_store_that_is_resumed_goes_on_as_if_it_had_never_stopped() -> None:
    store = TileStore(2, 0.05)
    write(store, 0, (30, 0, 0), points((2, 0), (0, 3)))
    write(store, 0, (30, 5, 0), points((2, 0), (0, 3)))
    store.resample(np.zeros(2, dtype=np.int64))
    resumed = TileStore(2, 0.05)
    resumed.restore(copy.deepcopy(store.state()))
    for one in (store, resumed):
        assert one.row0 != one.col0
        write(one, 1, (31, -20, 0.1), points((5, 0), (0, 3)))
        recount(one)
    for index in range(2):
        assert content(resumed, index) == content(store, index) != {}
        assert stamps(resumed, index) == stamps(store, index)
    assert resumed.writes == store.writes == 3
