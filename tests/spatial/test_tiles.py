import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.spatial import (
    TILE_CELLS,
    UNKNOWN,
    InputError,
    Keyframes,
    KeyScans,
    LocalMap,
    OccupancyGrid,
    Tile,
    TiledMap,
)
from mrslam.spatial.tiles import distinct, window


def random_grid(seed: int, row0: int, col0: int, height: int, width: int) -> OccupancyGrid:
    rng = np.random.default_rng(seed)
    cells = rng.choice(np.array([-1, 0, 50, 100], dtype=np.int8), size=(height, width), p=[0.7, 0.1, 0.1, 0.1])
    return OccupancyGrid.at_cell(cells, 0.05, row0, col0)


@settings(max_examples=60, deadline=None)
@given(
    st.integers(0, 2**31),
    st.integers(-200, 200),
    st.integers(-200, 200),
    st.integers(0, 150),
    st.integers(0, 150),
)
def test_a_grid_survives_the_way_through_tiles(seed, row0, col0, height, width):
    grid = random_grid(seed, row0, col0, height, width).cropped()
    back = TiledMap.from_grid(grid).to_grid()
    assert back.shape == grid.shape
    np.testing.assert_array_equal(back.cells, grid.cells)
    if grid.cells.size:
        assert back.cell0 == grid.cell0


@settings(max_examples=40, deadline=None)
@given(st.integers(0, 2**31), *[st.integers(-150, 150)] * 4, *[st.integers(0, 150)] * 2)
def test_a_window_of_tiles_holds_what_the_grid_does_there(seed, row0, col0, row, col, height, width):
    grid = random_grid(seed, row0, col0, 100, 90)
    tiles = {index: tile.cells for index, tile in TiledMap.from_grid(grid).tiles.items()}
    expected = np.full((height, width), UNKNOWN, dtype=np.int8)
    for r in range(max(row, row0), min(row + height, row0 + 100)):
        for c in range(max(col, col0), min(col + width, col0 + 90)):
            expected[r - row, c - col] = grid.cells[r - row0, c - col0]
    np.testing.assert_array_equal(window(tiles, row, col, height, width), expected)


FAR = st.sampled_from([0, 1, -1, 2**31 - 1, -(2**31) + 1, 2**16])


@given(st.lists(st.tuples(FAR, FAR), max_size=12))
def test_equal_places_are_one(places: list[tuple[int, int]]) -> None:
    rows = np.array(places, dtype=np.int64).reshape(-1, 2)
    first, which = distinct(rows)
    np.testing.assert_array_equal(rows[first][which], rows)
    assert len(first) == len(set(places))


def test_tiles_lie_where_their_index_says_also_below_zero():
    cells = np.full((1, 1), 100, dtype=np.int8)
    for row, col, index in [(0, 0, (0, 0)), (-1, -1, (-1, -1)), (63, 64, (0, 1)), (-64, -65, (-1, -2))]:
        tiled = TiledMap.from_grid(OccupancyGrid.at_cell(cells, 0.05, row, col))
        assert list(tiled.tiles) == [index]
        tile = tiled.tiles[index].cells
        assert tile[row % TILE_CELLS, col % TILE_CELLS] == 100
        assert (tile != UNKNOWN).sum() == 1


def test_unknown_tiles_are_not_kept_and_tiles_are_read_only():
    cells = np.full((TILE_CELLS * 3, TILE_CELLS), UNKNOWN, dtype=np.int8)
    cells[0, 0], cells[-1, 0] = 0, 100
    tiled = TiledMap.from_grid(OccupancyGrid(cells, 0.05))
    assert sorted(tiled.tiles) == [(0, 0), (2, 0)]
    assert not tiled.tiles[0, 0].cells.flags.writeable


def test_an_empty_map_is_an_empty_grid():
    assert TiledMap(0.05).to_grid().shape == (0, 0)
    assert TiledMap.from_grid(OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)).tiles == {}


def test_changed_since_gives_later_tiles_in_order():
    blank = np.zeros((TILE_CELLS, TILE_CELLS), dtype=np.int8)
    tiles = {(1, 0): Tile(3, blank), (0, 2): Tile(5, blank), (0, 0): Tile(4, blank)}
    tiled = TiledMap(0.05, tiles, 5)
    assert list(tiled.changed_since(3)) == [(0, 0), (0, 2)]
    assert list(tiled.changed_since(0)) == [(0, 0), (0, 2), (1, 0)]
    assert tiled.changed_since(5) == {}


def test_a_map_brings_a_scan_for_every_keyframe_or_none():
    keyframes = Keyframes(np.arange(2), np.zeros((2, 3)))
    assert len(LocalMap(TiledMap(0.05), keyframes).key_scans) == 0
    assert len(LocalMap(TiledMap(0.05), keyframes, KeyScans.blank(2)).key_scans) == 2
    with pytest.raises(InputError, match="2 keyframes need as many scans or none, got 1"):
        LocalMap(TiledMap(0.05), keyframes, KeyScans.blank(1))
