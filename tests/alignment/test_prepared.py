"""Making maps ready to be aligned."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig
from mrslam.alignment.kernels.walls import FREE, OCCUPIED
from mrslam.alignment.prepared import is_smaller, main_part, prepare, working_resolution
from mrslam.spatial import OccupancyGrid


@pytest.mark.parametrize("res", [0.05, 0.07, 0.1, 0.2])
def test_coarser_cells_hold_a_wall_where_any_of_theirs_does_else_free_space(res):
    rng = np.random.default_rng(4)
    grid = OccupancyGrid(rng.choice([-1, 0, 100], (37, 53), p=[0.5, 0.3, 0.2]).astype(np.int8), 0.05)
    side = prepare(grid, res)
    expected = np.zeros(side.state.shape, dtype=np.uint8)
    border = round(-side.x0 / res)
    for value, mask in ((FREE, grid.is_free), (OCCUPIED, grid.is_occupied)):
        for r, c in np.argwhere(mask):
            at = int((r + 0.5) * 0.05 / res) + border, int((c + 0.5) * 0.05 / res) + border
            expected[at] = value
    np.testing.assert_array_equal(side.state, expected)


@pytest.mark.parametrize(
    ("cells_m", "worked_m"), [((0.01, 0.02), 0.05), ((0.02, 0.045), 0.045), ((0.05, 0.1), 0.1), ((0.05, 0.05), 0.05)]
)
def test_maps_are_compared_by_the_coarser_cells_and_no_finer_than_asked_for(
    cells_m: tuple[float, float], worked_m: float
) -> None:
    a, b = (OccupancyGrid(np.zeros((50, 40), np.int8), cell_m) for cell_m in cells_m)
    assert working_resolution(a, b, AlignmentConfig()) == working_resolution(b, a, AlignmentConfig()) == worked_m


def test_maps_of_too_many_cells_are_compared_by_larger_ones() -> None:
    small, large = (OccupancyGrid(np.zeros((n, n), np.int8), 0.05) for n in (100, 500))
    for most, worked_m in ((250_000, 0.05), (249_999, 0.1), (62_499, 0.2)):
        assert working_resolution(small, large, AlignmentConfig(max_cells=most)) == worked_m


def test_only_large_parts_that_nothing_joins_are_left_out():
    cells = np.full((100, 200), -1, dtype=np.int8)
    cells[10:90, 10:100] = 0
    cells[40:44, 110:114] = 0  # a scrap
    assert main_part(OccupancyGrid(cells, 0.05)).shape == (100, 200)
    cells[10:90, 120:190] = 0
    kept = main_part(OccupancyGrid(cells, 0.05))
    assert kept.known_area_m2() == pytest.approx(80 * 90 * 0.0025)
    assert kept.origin_m == pytest.approx((0.5, 0.5))
    cells[50, 100:120] = 0  # a corridor joins them
    assert main_part(OccupancyGrid(cells, 0.05)).shape == (100, 200)


def test_maps_have_one_order_whatever_their_cells():
    fine, coarse = OccupancyGrid(np.zeros((99, 99), np.int8), 0.01), OccupancyGrid(np.zeros((20, 20), np.int8), 0.1)
    assert is_smaller(fine, coarse) and not is_smaller(coarse, fine)  # by area
    marks = np.zeros((20, 20), np.int8)
    marks[3, 4] = 100
    for other in (OccupancyGrid(marks, 0.1), OccupancyGrid(np.zeros((10, 10), np.int8), 0.2)):
        assert is_smaller(coarse, other) != is_smaller(other, coarse)


def test_of_too_many_wall_points_both_sides_of_a_wall_are_kept(monkeypatch):
    cells = np.zeros((200, 200), np.int8)
    cells[10:190:20, 10:190] = 100
    grid = OccupancyGrid(cells, 0.05)
    whole = prepare(grid, 0.05)
    monkeypatch.setattr("mrslam.alignment.prepared.wall_kernels.NOTHING", len(whole.points) // 2)
    up = prepare(grid, 0.05).normals[:, 1] > 0.5
    assert 0.4 * len(whole.points) < len(up) <= len(whole.points) // 2
    assert np.mean(up) == pytest.approx(0.5, abs=0.02)
