import numpy as np
import pytest

from mrslam.merge import Bend
from mrslam.merge.grids.tiled_grid import TiledGrid
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
