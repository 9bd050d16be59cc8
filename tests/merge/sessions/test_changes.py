"""What was seen later wins where it was seen; walls that are seen again stay where they were."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.merge.sessions.changes import changes, later_wins, near_walls, on_one_lattice
from mrslam.spatial import InputError, OccupancyGrid

BOX = np.s_[30:36, 40:46]


def floor(*, wall_col: int = 10) -> np.ndarray:
    """A floor of 80 x 80 cells with a wall that is one cell thick."""
    cells = np.zeros((80, 80), dtype=np.int8)
    cells[:, wall_col] = 100
    return cells


def grid(cells: np.ndarray) -> OccupancyGrid:
    return OccupancyGrid(cells, 0.05)


def test_a_box_that_went_and_one_that_came() -> None:
    before, after = floor(), floor()
    before[BOX] = 100
    after[60:63, 60:63] = 100
    found = changes(grid(before), grid(after))
    assert found.vanished.sum() == 36 and found.vanished[BOX].all()
    assert found.appeared.sum() == 9 and found.appeared[60:63, 60:63].all()
    assert np.array_equal(later_wins(grid(before), grid(after)).cells, after)


@pytest.mark.parametrize("shift", [-2, -1, 1, 2])
def test_a_wall_that_is_drawn_beside_itself_neither_moves_nor_thickens(shift: int) -> None:
    now = grid(floor())
    for _ in range(10):  # visits
        now = later_wins(now, grid(floor(wall_col=10 + shift)))
    assert np.array_equal(now.cells, floor())
    found = changes(grid(floor()), grid(floor(wall_col=10 + shift)))
    assert not found.appeared.any() and not found.vanished.any()


def test_a_wall_that_moved_farther_than_maps_are_apart_has_moved() -> None:
    found = changes(grid(floor()), grid(floor(wall_col=13)))
    assert found.appeared.sum() == found.vanished.sum() == 80


def test_what_was_not_seen_again_stays() -> None:
    before, after = floor(), floor()
    before[BOX] = 100
    after[BOX] = -1
    assert not changes(grid(before), grid(after)).vanished.any()
    assert np.array_equal(later_wins(grid(before), grid(after)).cells, before)


def test_what_is_seen_for_the_first_time_is_no_change() -> None:
    before = floor()
    before[20:70, 30:70] = -1
    after = floor()
    after[BOX] = 100
    found = changes(grid(before), grid(after))
    assert not found.appeared.any() and not found.vanished.any()
    assert np.array_equal(later_wins(grid(before), grid(after)).cells, after)


def test_what_is_between_free_and_occupied_says_nothing() -> None:
    before, after = floor(), floor()
    before[BOX], after[BOX] = 100, 50
    assert not changes(grid(before), grid(after)).vanished.any()
    assert (later_wins(grid(before), grid(after)).cells[BOX] == 100).all()


def test_maps_are_widened_to_one_extent() -> None:
    one = OccupancyGrid.at_cell(np.zeros((4, 6), dtype=np.int8), 0.05, 2, 3)
    two = OccupancyGrid.at_cell(np.full((5, 5), 100, dtype=np.int8), 0.05, -1, 0)
    nothing = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    wide = on_one_lattice(one, two, nothing)
    assert {one.cell0 for one in wide} == {(-1, 0)} and {one.shape for one in wide} == {(7, 9)}
    assert wide[0].is_free.sum() == 24 and wide[1].is_occupied.sum() == 25 and not wide[2].is_known.any()
    with pytest.raises(InputError, match="one lattice"):
        on_one_lattice(one, OccupancyGrid(np.zeros((2, 2), dtype=np.int8), 0.1))


def test_near_walls_is_a_disc() -> None:
    cells = np.zeros((11, 11), dtype=np.int8)
    cells[5, 5] = 100
    near = near_walls(grid(cells), 0.1)
    assert near.sum() == 13 and near[5, 7] and not near[6, 7]
