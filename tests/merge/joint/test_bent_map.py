import os

import numpy as np
import pytest

from mrslam.merge import Bend
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.bend_kernels import bend_tiles
from mrslam.merge.joint.bent_map import BentMap
from mrslam.spatial import OccupancyGrid
from tests.merge.joint.test_bend import KEYS, wave
from tests.merge.plans import building


def same(one: OccupancyGrid, two: OccupancyGrid) -> bool:
    return np.array_equal(one.cells, two.cells) and one.origin_m == pytest.approx(two.origin_m)


def drawn(bend: Bend, grid: OccupancyGrid, held: BentMap) -> OccupancyGrid:
    return held.draw(TiledGrid.of(grid), bend.displacement).grid


def part(grid: OccupancyGrid, rows: int, cols: int) -> OccupancyGrid:
    """The map when only so many of its rows and columns were seen."""
    cells = np.full(grid.shape, -1, dtype=np.int8)
    cells[:rows, :cols] = grid.cells[:rows, :cols]
    return OccupancyGrid(cells, grid.resolution_m, grid.origin_m)


def test_a_map_that_grows_and_changes_is_drawn_as_from_nothing():
    grid, bend, held, rng = building(3), Bend(KEYS, wave(KEYS, 1.0)), BentMap(), np.random.default_rng(0)
    height, width = grid.shape
    for share in (0.4, 0.6, 0.8, 1.0, 0.7, 1.0):
        seen = part(grid, int(share * height), int(share * width))
        row, col = rng.integers(0, height // 3), rng.integers(0, width // 3)
        seen.cells[row : row + 5, col : col + 5] = 100
        assert same(drawn(bend, seen, held), bend.bent(seen))


def test_another_bend_is_drawn_as_from_nothing():
    grid, held = building(3), BentMap()
    for amount_m in (0.3, 0.5, 0.500001, 1.7, 0.0):
        bend = Bend(KEYS, wave(KEYS, amount_m))
        assert same(drawn(bend, grid, held), bend.bent(grid))


def test_only_blocks_near_a_change_are_drawn_again():
    grid, bend, held = building(3), Bend(KEYS, wave(KEYS)), BentMap()
    drawn(bend, grid, held)
    whole = held.blocks_drawn
    drawn(bend, grid, held)
    assert held.blocks_drawn == whole
    changed = OccupancyGrid(grid.cells.copy(), grid.resolution_m, grid.origin_m)
    changed.cells[100, 100] = 100 - max(int(grid.cells[100, 100]), 0)
    drawn(bend, changed, held)
    assert 0 < held.blocks_drawn - whole <= 9


def test_maps_of_other_lattices_and_empty_ones_are_drawn():
    grid, bend, held = building(3), Bend(KEYS, wave(KEYS)), BentMap()
    shifted = OccupancyGrid(grid.cells, grid.resolution_m, (grid.origin_m[0] + 0.02, grid.origin_m[1]))
    for one in (grid, shifted, OccupancyGrid(grid.cells, 0.1, grid.origin_m), grid):
        assert same(drawn(bend, one, held), bend.bent(one))
    assert drawn(bend, OccupancyGrid(np.full((50, 50), -1, dtype=np.int8), 0.05), held).cells.size == 0


def test_a_room_that_was_moved_far_leaves_nothing_where_it_was_drawn():
    grid, held = building(3), BentMap()
    middle_m = np.add(grid.origin_m, np.array(grid.shape[::-1]) * grid.resolution_m / 2.0)
    for moved_m in (6.0, 0.0):

        def displacement(points: np.ndarray, moved_m: float = moved_m) -> np.ndarray:
            near = np.hypot(*(points - middle_m).T) < 2.0
            return np.where(near[:, None], (moved_m, 0.0), 0.0)

        assert same(*(one.draw(TiledGrid.of(grid), displacement).grid for one in (held, BentMap())))


def test_what_was_drawn_of_a_room_that_is_gone_goes_too():
    """It was bent into tiles where the map itself never was, and nothing else is near."""
    grid, held = building(3), BentMap()
    far = np.full((grid.shape[0], grid.shape[1] + 600), -1, dtype=np.int8)
    far[:, 600:] = grid.cells
    far[100:110, 100:110] = 100
    with_room = OccupancyGrid(far.copy(), grid.resolution_m, grid.origin_m)
    far[100:110, 100:110] = -1
    far[0, 0] = 0  # the box stays
    without = OccupancyGrid(far, grid.resolution_m, grid.origin_m)

    def displacement(points: np.ndarray) -> np.ndarray:
        return np.tile([0.0, 2.5], (len(points), 1))

    first, second = (held.draw(TiledGrid.of(one), displacement) for one in (with_room, without))
    assert first.tiles.keys() - second.tiles.keys()
    assert same(second.grid, BentMap().draw(TiledGrid.of(without), displacement).grid)
    assert all((tile >= 0).any() for tile in second.tiles.values())


def test_tiles_of_which_nothing_has_changed_are_the_same_objects():
    grid, bend, held = building(3), Bend(KEYS, wave(KEYS)), BentMap()
    before = held.draw(TiledGrid.of(grid), bend.displacement)
    grid.cells[100, 100] = 100 - max(int(grid.cells[100, 100]), 0)
    after = held.draw(TiledGrid.of(grid), bend.displacement)
    replaced = [index for index, tile in before.tiles.items() if after.tiles[index] is not tile]
    assert replaced == [i for i, tile in before.tiles.items() if not np.array_equal(after.tiles[i], tile)] != []


def test_a_map_is_moved_whole_also_where_it_ends():
    """Blocks beside it are reached by it, and moved as it is, half a block and more."""
    cells = np.zeros((96, 128), dtype=np.int8)
    for move_m in (0.9, -0.9, 6.4, -6.4):
        grid = OccupancyGrid(cells, 0.05)
        bent = BentMap().draw(TiledGrid.of(grid), lambda points, m=move_m: np.full((len(points), 2), m)).grid
        assert np.array_equal(bent.cells, cells) and bent.origin_m == pytest.approx((move_m, move_m))


@pytest.mark.parametrize("seed", [4, 7])
def test_a_way_to_and_fro_bends_a_map_as_from_nothing_though_lanes_are_moved_against_each_other(seed):
    """Displacement changes by half a metre and more within a block where the next lane drifted elsewhere."""
    rng, lanes = np.random.default_rng(seed), 6
    x = np.arange(0.0, 20.0, 0.5)
    keys = np.concatenate(
        [np.stack([x[:: 1 - 2 * (k % 2)], x * 0.0 + 3.0 * k, x * 0.0 + np.pi * (k % 2)], axis=1) for k in range(lanes)]
    )
    drift = np.cumsum(rng.normal(size=keys.shape), axis=0) / np.sqrt(len(keys)) * (2.0, 2.0, 0.02)
    bend, held, res = Bend(keys, keys + drift), BentMap(), 0.025
    cells = np.full((int((3 * lanes + 2) / res), int(24 / res)), -1, dtype=np.int8)
    for k in range(lanes):
        row, half = int((3 * k + 1) / res), int(1.2 / res)
        cells[max(row - half, 0) : row + half] = 0
        cells[max(row - half, 0) : row + half, rng.integers(0, cells.shape[1], 30)] = 100
        cells[min(row + half, cells.shape[0] - 1)] = 100
    for share in (0.3, 0.5, 0.7, 0.85, 1.0):
        seen, rows = np.full_like(cells, -1), int(share * cells.shape[0])
        seen[:rows] = cells[:rows]
        seen[rng.integers(0, rows, 5), rng.integers(0, cells.shape[1], 5)] = 100
        grid = OccupancyGrid.at_cell(seen, res, int(-1 / res), int(-2 / res))
        assert same(drawn(bend, grid, held), bend.bent(grid))


@pytest.mark.skipif(os.environ.get("NUMBA_DISABLE_JIT") == "1", reason="nothing is compiled")
def test_one_kernel_is_compiled_also_where_nothing_is_drawn_again():
    grid, bend, held = building(3), Bend(KEYS, wave(KEYS)), BentMap()
    for _ in range(2):
        drawn(bend, grid, held)
    assert len(bend_tiles.signatures) == 1


def test_a_map_whose_first_columns_go_is_drawn_as_from_nothing():
    grid, bend, held = building(3), Bend(KEYS, wave(KEYS)), BentMap()
    drawn(bend, grid, held)
    cells = grid.cells.copy()
    cells[:100, :] = cells[:, :200] = -1
    left = OccupancyGrid(cells, grid.resolution_m, grid.origin_m)
    assert same(drawn(bend, left, held), bend.bent(left))


def test_a_map_that_is_not_bent_stays_where_it_is_off_the_lattice_too():
    grid = building(3)
    shifted = OccupancyGrid(grid.cells, grid.resolution_m, (grid.origin_m[0] + 0.02, grid.origin_m[1] - 0.01))
    assert same(drawn(Bend(KEYS, KEYS), shifted, BentMap()), shifted.cropped())


def test_a_change_beside_the_border_of_a_block_is_drawn_beyond_it_too():
    """Whether a wall is drawn thin is told by the cells next to it, wherever they are moved to."""
    rng = np.random.default_rng(0)
    for _ in range(30):
        cells = np.zeros((160, 160), dtype=np.int8)
        cells[60:70] = rng.choice(np.array([0, 100], dtype=np.int8), (10, 160))
        changed = cells.copy()
        changed[64, 40:100:3] = 100 - changed[64, 40:100:3]
        held = BentMap()
        for grid in (cells, changed):
            last = held.draw(TiledGrid.of(OccupancyGrid(grid, 0.05)), lambda points: np.full((len(points), 2), -1.5875))
        anew = BentMap().draw(
            TiledGrid.of(OccupancyGrid(changed, 0.05)), lambda points: np.full((len(points), 2), -1.5875)
        )
        assert same(last.grid, anew.grid)
