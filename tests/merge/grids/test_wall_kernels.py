"""Which cells of a wall are part of an area, and which of its neighbours a wall cell is joined with by a line."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.merge.grids.wall_kernels import draw_wall, is_linked, is_thick


def grid(*rows: str) -> np.ndarray:
    return np.array([[100 if cell == "#" else 0 for cell in row] for row in rows], dtype=np.int8)


def test_all_four_cells_of_a_block_are_thick_and_no_cell_of_a_line_or_a_corner_is() -> None:
    block = grid("....", ".##.", ".##.", "....")
    thick = [[is_thick(block, r, c) for c in range(1, 3)] for r in range(1, 3)]
    assert thick == [[True, True], [True, True]]
    for thin in (grid("###"), grid("#..", "#..", "###"), grid("#.", ".#")):
        assert not any(is_thick(thin, int(r), int(c)) for r, c in np.argwhere(thin))


@pytest.mark.parametrize(("dr", "dc", "linked"), [(0, 1, True), (1, 0, False), (1, 1, True), (-1, 1, False)])
def test_a_diagonal_is_a_link_where_no_corner_joins_its_ends(dr: int, dc: int, linked: bool) -> None:
    cells = grid("....", ".##.", "....", "....") if dr <= 0 and dc == 1 else grid("....", ".#..", "..#.", "....")
    assert is_linked(cells, 1, 1, dr, dc, False, True) is linked


def test_around_a_corner_there_is_no_short_cut() -> None:
    corner = grid("....", ".#..", ".##.", "....")
    assert is_linked(corner, 1, 1, 1, 0, False, True) and not is_linked(corner, 1, 1, 1, 1, False, True)


def test_cells_of_an_area_are_joined_by_the_sampling() -> None:
    area = grid("....", ".##.", ".##.", "....")
    assert not is_linked(area, 1, 1, 0, 1, True, True) and is_linked(area, 1, 1, 0, 1, False, True)


def test_each_half_of_a_line_has_the_certainty_of_its_end() -> None:
    cells = np.zeros((3, 5), dtype=np.int8)
    cells[1, 1:3] = 100, 70
    inverse = np.array([[1.0, 0.0, -0.4], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # the map lies 0.4 cells to the right
    out = np.full((3, 5), -1, dtype=np.int8)
    for col in (1, 2):
        draw_wall(cells, inverse, 1.0, 1, col, 0, 0, out)
    assert out.tolist() == [[-1] * 5, [-1, 100, 70, -1, -1], [-1] * 5]


def test_of_two_wall_cells_that_fall_into_one_the_surer_stays() -> None:
    cells = np.array([[100, 70, 0, 0], [0, 0, 0, 0]], dtype=np.int8)
    out = np.full((1, 2), -1, dtype=np.int8)
    for col in (0, 1):
        draw_wall(cells, np.diag([2.0, 2.0, 1.0]), 2.0, 0, col, 0, 0, out)
    assert out.tolist() == [[100, -1]]
