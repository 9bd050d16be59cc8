import numpy as np
import pytest

from mrslam.merge.grids.tiled_grid import BLOCK_CELLS, TiledGrid
from mrslam.spatial import UNKNOWN, OccupancyGrid, TiledMap

RNG = np.random.default_rng(0)


def random_grid(height: int, width: int, origin_m: tuple[float, float]) -> OccupancyGrid:
    cells = np.full((height, width), UNKNOWN, dtype=np.int8)
    for row, col in zip(RNG.integers(0, height, 9), RNG.integers(0, width, 9), strict=True):
        cells[row : row + 3, col : col + 3] = RNG.integers(0, 101)
    return OccupancyGrid(cells, 0.05, origin_m)


def cells_of(grid: OccupancyGrid) -> dict:
    row0, col0 = grid.cell0
    return {(row0 + r, col0 + c): grid.cells[r, c] for r, c in np.argwhere(grid.is_known)}


@pytest.mark.parametrize("origin_m", [(0.0, 0.0), (-7.35, 3.1), (1.012, -4.487)])
def test_a_map_in_tiles_is_the_same_map_wherever_its_origin_is(origin_m):
    grid = random_grid(150, 200, origin_m).cropped()
    back = TiledGrid.of(grid).grid
    assert np.array_equal(back.cells, grid.cells) and back.origin_m == pytest.approx(grid.origin_m, abs=1e-12)


def test_tiles_without_a_known_cell_are_left_out():
    tiled = TiledMap.from_grid(OccupancyGrid(np.zeros((64, 128), dtype=np.int8), 0.05))
    gone = TiledMap(0.05, {**tiled.tiles, (5, 5): TiledMap.from_grid(random_grid(9, 9, (0.0, 0.0))).tiles[0, 0]})
    blank = np.full((64, 64), UNKNOWN, dtype=np.int8)
    gone = TiledMap(0.05, {**gone.tiles, (7, 7): type(tiled.tiles[0, 0])(1, blank)})
    assert sorted(TiledGrid.of(gone).tiles) == [(0, 0), (0, 1), (5, 5)]


def test_changed_blocks_are_those_with_a_cell_that_differs():
    for _ in range(20):
        before, after = (random_grid(90, 130, (0.85, -1.5)) for _ in range(2))
        after.cells[: RNG.integers(0, 90)] = before.cells[: RNG.integers(0, 90)][:1] if RNG.random() < 0.2 else UNKNOWN
        old, new = cells_of(before), cells_of(after)
        expected = {(r // BLOCK_CELLS, c // BLOCK_CELLS) for r, c in old | new if old.get((r, c)) != new.get((r, c))}
        changed = TiledGrid.of(after).changed_blocks(TiledGrid.of(before))
        assert set(map(tuple, changed.tolist())) == expected and len(changed) == len(expected)
    everything = {(r // BLOCK_CELLS, c // BLOCK_CELLS) for r, c in new}
    assert set(map(tuple, TiledGrid.of(after).changed_blocks(None).tolist())) == everything
    assert TiledGrid.of(after).changed_blocks(TiledGrid.of(after)).shape == (0, 2)


def test_a_window_shows_what_the_map_shows_there_and_nothing_beyond():
    grid = random_grid(150, 200, (-3.0, 2.0))
    known, tiled = cells_of(grid), TiledGrid.of(grid)
    for row, col, height, width in [(40, -60, 150, 200), (0, -100, 30, 90), (70, -33, 1, 1), (900, 900, 5, 5)]:
        window = tiled.window(row, col, height, width)
        expected = np.full((height, width), UNKNOWN)
        for (r, c), value in known.items():
            if row <= r < row + height and col <= c < col + width:
                expected[r - row, c - col] = value
        assert np.array_equal(window, expected)


def test_maps_a_cell_apart_are_not_of_one_lattice_though_their_cells_lie_on_each_other():
    cells = np.zeros((5, 5), dtype=np.int8)
    one, two = (TiledGrid.of(OccupancyGrid(cells, 0.05, (x, 0.0))) for x in (0.025, -0.025))
    assert one.tiles.keys() == {(0, 0)} and not one.has_lattice_of(two)
    assert one.has_lattice_of(TiledGrid.of(OccupancyGrid(cells, 0.05, (0.125, 3.0))))
    assert not one.has_lattice_of(TiledGrid.of(OccupancyGrid(cells, 0.1, (0.025, 0.0))))


@pytest.mark.parametrize("origin_m", [(0.0, 0.0), (-7.33, 11.02), (3.21, -9.87)])
def test_values_at_points_are_those_of_the_cells_there_and_unknown_beyond(origin_m: tuple[float, float]) -> None:
    grid = random_grid(150, 170, origin_m)
    inside = np.argwhere(np.ones(grid.shape, dtype=np.bool_))
    points = (inside[:, ::-1] + RNG.uniform(0.05, 0.95, inside.shape)) * 0.05 + np.array(grid.origin_m)
    tiled = TiledGrid.of(grid)
    np.testing.assert_array_equal(tiled.values_at(points), grid.cells[tuple(inside.T)])
    assert (tiled.values_at(points + 40.0) == UNKNOWN).all() and (tiled.values_at(points - 40.0) == UNKNOWN).all()
    assert (TiledGrid({}, 0.05).values_at(points) == UNKNOWN).all()
