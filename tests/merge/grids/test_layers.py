import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.merge import warp
from mrslam.merge.grids.layers import Layer
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.spatial import TILE_CELLS, UNKNOWN, OccupancyGrid, se2
from tests.merge.plans import building

PLAN = building(5)


def assembled(layer: Layer) -> dict:
    """Return known cells by lattice (row, col)."""
    out = {}
    for (i, j), tile in layer.tiles.items():
        for r, c in np.argwhere(tile != UNKNOWN):
            out[i * TILE_CELLS + r, j * TILE_CELLS + c] = tile[r, c]
    return out


def cells_of(grid: OccupancyGrid) -> dict:
    row0, col0 = grid.cell0
    return {(row0 + r, col0 + c): grid.cells[r, c] for r, c in np.argwhere(grid.is_known)}


def with_patch(grid: OccupancyGrid, row: int, col: int, value: int) -> OccupancyGrid:
    cells = grid.cells.copy()
    cells[row : row + 4, col : col + 4] = value
    return OccupancyGrid(cells, grid.resolution_m, grid.origin_m)


@settings(max_examples=25, deadline=None)
@given(
    st.floats(-3, 3),
    st.floats(-3, 3),
    st.floats(-3.1, 3.1),
    st.lists(st.tuples(st.integers(0, 140), st.integers(0, 300), st.sampled_from([-1, 0, 100])), max_size=5),
    st.sampled_from([0.05, 0.1, 0.03]),
)
def test_following_changes_gives_what_starting_anew_gives(x, y, theta, patches, resolution):
    T, grid, layer = se2.transform(x, y, theta), PLAN, Layer()
    layer.update(TiledGrid.of(grid), T, resolution)
    for row, col, value in patches:
        grid = with_patch(grid, row, col, value)
        layer.update(TiledGrid.of(grid), T, resolution)
    anew = Layer()
    anew.update(TiledGrid.of(grid), T, resolution)
    assert layer.tiles.keys() == anew.tiles.keys()
    assert layer.versions == anew.versions
    for index, tile in layer.tiles.items():
        np.testing.assert_array_equal(tile, anew.tiles[index])


@pytest.mark.parametrize("resolution", [0.05, 0.08])
def test_tiles_are_the_warped_map(resolution):
    T, layer = se2.transform(1.0, -2.0, 0.7), Layer()
    layer.update(TiledGrid.of(PLAN), T, resolution)
    assert assembled(layer) == cells_of(warp(PLAN, T, resolution))


@pytest.mark.parametrize("theta", [0.05, 0.7, 1.6, -2.3])
def test_walls_go_on_from_tile_to_tile(theta):
    """Lines in all directions, one and two cells thick, over many tiles."""
    cells = np.zeros((300, 300), dtype=np.int8)
    for k in range(0, 280, 20):
        line = np.arange(20, 280)
        cells[k, line] = cells[line, k] = cells[line, np.clip(line + k - 140, 0, 299)] = 100
        cells[k + 8 : k + 10, line] = 100
    grid, T, layer = OccupancyGrid(cells, 0.05), se2.transform(0.313, -2.207, theta), Layer()
    layer.update(TiledGrid.of(grid), T, 0.05)
    assert assembled(layer) == cells_of(warp(grid, T, 0.05))


def test_only_tiles_near_a_change_are_rewritten():
    T, layer = se2.transform(1.0, -2.0, 0.7), Layer()
    layer.update(TiledGrid.of(PLAN), T, 0.05)
    everything = layer.warped
    layer.update(TiledGrid.of(with_patch(PLAN, 20, 30, 50)), T, 0.05)
    assert 0 < layer.warped - everything <= 12 < everything
    held = layer.warped
    layer.update(TiledGrid.of(with_patch(PLAN, 20, 30, 50)), T, 0.05)
    assert layer.warped == held


def test_growing_shrinking_moving_and_vanishing():
    layer, T = Layer(), se2.transform(0.5, 0.5, 1.0)
    small = OccupancyGrid.at_cell(PLAN.cells[:50, :50], 0.05, 0, 0)
    empty = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    shifted = OccupancyGrid(small.cells, 0.05, (0.02, 0.013))
    coarse = OccupancyGrid(small.cells, 0.1)
    places = [
        (small, T),
        (PLAN, T),
        (small, T),
        (shifted, T),
        (small, se2.IDENTITY),
        (empty, T),
        (small, T),
        (coarse, T),
    ]
    for grid, place in places:
        layer.update(TiledGrid.of(grid), place, 0.05)
        anew = Layer()
        anew.update(TiledGrid.of(grid), place, 0.05)
        assert layer.versions == anew.versions


def test_a_map_that_stays_is_laid_anew_where_the_teams_cells_get_finer():
    T, layer, anew, tiled = se2.transform(1.0, -2.0, 0.7), Layer(), Layer(), TiledGrid.of(PLAN)
    for resolution_m in (0.08, 0.05):
        layer.update(tiled, T, resolution_m)
    anew.update(tiled, T, 0.05)
    assert layer.versions == anew.versions


def test_a_change_beside_the_border_of_a_tile_is_drawn_beyond_it_too():
    """Whether a wall is drawn thin is told by the cells next to it."""
    rng, T = np.random.default_rng(0), se2.transform(0.04, 0.02, 0.0)
    for _ in range(60):
        cells = np.zeros((TILE_CELLS + 2, 128), dtype=np.int8)
        cells[60:] = rng.choice(np.array([0, 100], dtype=np.int8), (6, 128))
        changed = cells.copy()
        changed[TILE_CELLS, 40:60:3] = 100 - changed[TILE_CELLS, 40:60:3]
        layer, anew = Layer(), Layer()
        for grid in (cells, changed):
            layer.update(TiledGrid.of(OccupancyGrid(grid, 0.05)), T, 0.05)
        anew.update(TiledGrid.of(OccupancyGrid(changed, 0.05)), T, 0.05)
        assert layer.versions == anew.versions
