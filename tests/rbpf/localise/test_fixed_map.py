"""A grid's walls as the hits that a laser would have left."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.rbpf.localise.fixed_map import SPARE, FixedMap, surfaces_m
from mrslam.spatial import InputError, OccupancyGrid
from mrslam.spatial.hits.cells import hits_of, visits_of
from mrslam.spatial.hits.views import Tiles


def grid_of(cells: np.ndarray, resolution_m: float = 0.05, origin_m: tuple[float, float] = (0.0, 0.0)) -> OccupancyGrid:
    return OccupancyGrid(cells.astype(np.int8), resolution_m, origin_m)


def wall(rows: slice, *, behind: int = -1) -> np.ndarray:
    """A wall along x, free floor below it, and ``behind`` beyond."""
    cells = np.zeros((40, 60), dtype=np.int8)
    cells[rows.start :] = behind
    cells[rows] = 100
    return cells


def word_at(tiles: Tiles, x_m: float, y_m: float) -> int:
    col, row = int(np.floor(x_m / tiles.resolution_m)), int(np.floor(y_m / tiles.resolution_m))
    tile = tiles.table[(row >> 5) - tiles.row0, (col >> 5) - tiles.col0]
    return int(tiles.pool[tile, ((row & 31) << 5) | (col & 31)])


@pytest.mark.parametrize("thick", [1, 2])
def test_a_wall_becomes_a_line_through_its_middle_that_faces_the_floor(thick: int) -> None:
    surfaces = surfaces_m(grid_of(wall(slice(20, 20 + thick))), 0.05)
    inner = surfaces[(surfaces[:, 0] > 0.5) & (surfaces[:, 0] < 2.5)]
    assert np.abs(inner[:, 1] - (1.0 + 0.025 * thick)).max() < 1e-6
    np.testing.assert_allclose(inner[:, 2:], np.tile([0.0, -1.0, 1.0], (len(inner), 1)), atol=1e-9)


def test_a_wall_askew_is_no_staircase() -> None:
    rows, cols = np.mgrid[:80, :120]
    above = rows - 30 - 0.2 * cols
    cells = np.where(above > 1.0, -1, np.where(above > 0.0, 100, 0))
    surfaces = surfaces_m(grid_of(cells), 0.05)
    inner = surfaces[(surfaces[:, 0] > 0.5) & (surfaces[:, 0] < 5.0)]
    off_m = (inner[:, 1] - (1.5 + 0.2 * inner[:, 0])) / np.hypot(1.0, 0.2)
    assert np.ptp(off_m) < 0.03  # a cell is 0.05 m
    normal = np.array([0.2, -1.0]) / np.hypot(1.0, 0.2)
    assert (inner[:, 2:4] @ normal).min() > np.cos(np.radians(3.0))


def test_a_thin_wall_between_two_rooms_faces_neither() -> None:
    surfaces = surfaces_m(grid_of(wall(slice(20, 21), behind=0)), 0.05)
    assert not surfaces[:, 4].any() and (np.abs(surfaces[:, 3]) > 0.99).all()


def test_a_solid_wall_has_two_faces_and_nothing_between() -> None:
    surfaces = surfaces_m(grid_of(wall(slice(16, 24), behind=0)), 0.05)
    inner = surfaces[(surfaces[:, 0] > 0.5) & (surfaces[:, 0] < 2.5)]
    low, high = inner[inner[:, 1] < 1.0], inner[inner[:, 1] > 1.0]
    assert np.abs(low[:, 1] - 0.825).max() < 1e-6 and np.abs(high[:, 1] - 1.175).max() < 1e-6
    assert (low[:, 3] < -0.99).all() and (high[:, 3] > 0.99).all()


def test_faces_of_a_wall_nearer_than_a_line_is_long_are_still_two() -> None:
    surfaces = surfaces_m(grid_of(wall(slice(16, 20), behind=0)), 0.05)
    inner = surfaces[(surfaces[:, 0] > 0.5) & (surfaces[:, 0] < 2.5)]
    low = inner[:, 3] < 0.0
    assert np.abs(inner[low, 1] - 0.825).max() < 1e-6 and np.abs(inner[~low, 1] - 0.975).max() < 1e-6


def test_the_side_of_a_wall_that_no_beam_can_hit_is_none() -> None:
    surfaces = surfaces_m(grid_of(wall(slice(20, 28))), 0.05)
    inner = surfaces[(surfaces[:, 0] > 0.5) & (surfaces[:, 0] < 2.5)]
    assert np.abs(inner[:, 1] - 1.025).max() < 1e-6


def test_a_wall_at_the_maps_rim_is_a_line_through_its_middle_too() -> None:
    surfaces = surfaces_m(grid_of(wall(slice(38, 40))), 0.05)
    inner = surfaces[(surfaces[:, 0] > 0.5) & (surfaces[:, 0] < 2.5)]
    assert np.abs(inner[:, 1] - 1.95).max() < 1e-6


def test_a_post_has_no_normal_and_stays_where_it_is() -> None:
    cells = np.zeros((40, 60))
    cells[20:22, 30:32] = 100
    surfaces = surfaces_m(grid_of(cells), 0.05)
    assert sorted(map(tuple, surfaces[:, :2].round(6))) == [
        (1.525, 1.025),
        (1.525, 1.075),
        (1.575, 1.025),
        (1.575, 1.075),
    ]
    assert not surfaces[:, 2:].any()


def test_what_stands_out_from_a_wall_farther_than_a_cell_is_not_drawn_onto_it() -> None:
    cells = wall(slice(20, 21))
    cells[18:20, 30] = 100
    surfaces = surfaces_m(grid_of(cells), 0.05)
    tip = surfaces[np.abs(surfaces[:, 0] - 1.525) < 0.01, 1].min()
    assert tip == pytest.approx(0.925, abs=1e-6)


def test_coarse_cells_leave_no_gaps_along_a_wall() -> None:
    surfaces = surfaces_m(grid_of(wall(slice(20, 21)), 0.2), 0.05)
    along = np.sort(surfaces[:, 0])
    assert np.diff(along).max() == pytest.approx(0.05, abs=1e-6)
    assert np.abs(surfaces[:, 1] - 4.1).max() < 1e-6


@pytest.mark.parametrize("origin_m", [(0.0, 0.0), (-13.37, 4.02)])
def test_floor_is_free_walls_are_hit_and_the_rest_is_unknown(origin_m: tuple[float, float]) -> None:
    tiles = FixedMap(grid_of(wall(slice(20, 21)), origin_m=origin_m), 0.05).tiles_around(np.zeros(3))
    x, y = origin_m
    floor, hit, beyond = (
        word_at(tiles, x + 1.5, y + 0.5),
        word_at(tiles, x + 1.5, y + 1.025),
        word_at(tiles, x, y + 1.8),
    )
    assert hits_of(floor) == 0 and visits_of(floor) > 0
    assert hits_of(hit) == visits_of(hit) > 0 and hit >> 31 == 1
    assert beyond == 0 and not tiles.pool[0].any()


def test_floor_is_free_where_the_middle_of_a_fine_cell_is() -> None:
    cells = np.where(np.random.default_rng(3).random((12, 17)) < 0.5, 0, -1)
    cells[5, 8] = 100
    grid = grid_of(cells, 0.2, (-1.13, 0.42))
    tiles = FixedMap(grid, 0.05).tiles_around(np.zeros(3))
    for row in range(12 * 4):
        for col in range(-24, 17 * 4 - 24):
            x, y = 0.05 * (col + 0.5), 0.05 * (row + 8.5)
            c, r = int(np.floor((x + 1.13) / 0.2)), int(np.floor((y - 0.42) / 0.2))
            is_free = 0 <= c < 17 and 0 <= r < 12 and cells[r, c] == 0
            if hits_of(word := word_at(tiles, x, y)) == 0:
                assert (visits_of(word) > 0) == is_free


def test_a_wall_between_two_rooms_is_seen_from_either() -> None:
    tiles = FixedMap(grid_of(wall(slice(20, 21), behind=0)), 0.05).tiles_around(np.zeros(3))
    assert hits_of(word_at(tiles, 1.5, 1.025)) > 0 and word_at(tiles, 1.5, 1.025) >> 31 == 0


@pytest.mark.parametrize("size", [(40, 60), (64, 64), (65, 31)])
def test_empty_tiles_lie_around_a_map(size: tuple[int, int]) -> None:
    cells = np.zeros(size)
    cells[0] = cells[-1] = cells[:, 0] = cells[:, -1] = 100
    tiles = FixedMap(grid_of(cells, origin_m=(-0.4, 3.3)), 0.05).tiles_around(np.zeros(3))
    rows, cols = np.nonzero(tiles.table)
    for at, count in zip((rows, cols), tiles.table.shape, strict=True):
        assert at.min() >= SPARE and at.max() < count - SPARE


def test_a_map_without_walls_is_refused() -> None:
    with pytest.raises(InputError, match="without walls"):
        FixedMap(grid_of(np.zeros((40, 40))), 0.05)
