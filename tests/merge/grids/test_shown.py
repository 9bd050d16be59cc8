"""What several maps show near a cell."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.merge.grids.shown import Shown
from mrslam.spatial import TILE_CELLS

KINDS = np.array([-1, 0, 25, 50, 75, 100], dtype=np.int8)
PLACES = [(0, 0), (0, 1), (-1, 0)]


def tiles(seed: int) -> dict:
    rng = np.random.default_rng(seed)
    out = {}
    for place in PLACES:
        cells = np.full((TILE_CELLS, TILE_CELLS), -1, dtype=np.int8)
        some = rng.integers(0, TILE_CELLS, (40, 2))
        cells[tuple(some.T)] = rng.choice(KINDS, 40)
        out[place] = cells
    return out


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 1000), st.integers(1, 3))
def test_a_cell_is_shown_where_a_map_has_the_same_near_it(seed: int, near: int) -> None:
    maps = [tiles(seed), tiles(seed + 1)]
    rng = np.random.default_rng(seed)
    cells, is_wall = rng.integers(-TILE_CELLS - 5, 2 * TILE_CELLS + 5, (60, 2)), rng.random(60) < 0.5
    known = [
        [
            (TILE_CELLS * i + r, TILE_CELLS * j + c, tile[r, c])
            for (i, j), tile in one.items()
            for r, c in np.argwhere(tile >= 0)
        ]
        for one in maps
    ]
    wanted = [
        sum(
            any(
                max(abs(row - r), abs(col - c)) <= near and (value >= 65 if wall else value <= 35)
                for r, c, value in one
            )
            for one in known
        )
        for (row, col), wall in zip(cells.tolist(), is_wall.tolist(), strict=True)
    ]
    assert Shown(maps, near).count(cells, is_wall).tolist() == wanted


def test_a_wall_is_shown_beyond_the_edge_of_its_tile() -> None:
    cells = np.full((TILE_CELLS, TILE_CELLS), -1, dtype=np.int8)
    cells[TILE_CELLS - 1, 0] = 100
    asked = np.array([[TILE_CELLS, -1], [TILE_CELLS + 1, -2], [TILE_CELLS + 2, -1], [TILE_CELLS, -3]])
    assert Shown([{(0, 0): cells}], 2).count(asked, np.ones(4, dtype=np.bool_)).tolist() == [1, 1, 0, 0]


def test_no_maps_show_nothing() -> None:
    shown = Shown([], 2).count(np.array([[0, 0], [-70, 3]]), np.array([True, False]))
    assert shown.tolist() == [0, 0]
    assert Shown([], 2).count(np.empty((0, 2), dtype=np.int64), np.empty(0, dtype=np.bool_)).size == 0
