import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from mrslam.spatial.traversal import traverse

coordinate = st.floats(-30, 30)


def cells_of(x0, y0, x1, y1):
    room = abs(math.floor(x1) - math.floor(x0)) + abs(math.floor(y1) - math.floor(y0)) + 1
    rows, cols = np.empty(room, dtype=np.int32), np.empty(room, dtype=np.int32)
    count = traverse(x0, y0, x1, y1, rows, cols)
    assert count == room
    return list(zip(rows.tolist(), cols.tolist(), strict=True))


def distance_to_segment(row, col, x0, y0, x1, y1):
    """Chebyshev distance from the cell's box to the nearest of many points of the segment: 0 where it is crossed."""
    t = np.linspace(0.0, 1.0, 2001)
    x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
    dx = np.maximum(np.maximum(col - x, x - col - 1), 0.0)
    dy = np.maximum(np.maximum(row - y, y - row - 1), 0.0)
    return float(np.maximum(dx, dy).min())


@settings(deadline=None)
@given(coordinate, coordinate, coordinate, coordinate)
def test_the_beams_cells_form_a_chain_along_it(x0, y0, x1, y1):
    cells = cells_of(x0, y0, x1, y1)
    assert cells[0] == (math.floor(y0), math.floor(x0))
    assert cells[-1] == (math.floor(y1), math.floor(x1))
    for (r, c), (rr, cc) in itertools.pairwise(cells):
        assert abs(rr - r) + abs(cc - c) == 1  # side by side: nothing slips between them
    assert len(set(cells)) == len(cells)
    for row, col in cells:
        assert distance_to_segment(row, col, x0, y0, x1, y1) < 0.05


@settings(deadline=None)
@given(coordinate, coordinate, coordinate, coordinate)
def test_no_cell_that_the_beam_passes_well_inside_is_missed(x0, y0, x1, y1):
    cells = set(cells_of(x0, y0, x1, y1))
    for t in np.linspace(0.0, 1.0, 400):
        x, y = x0 + t * (x1 - x0), y0 + t * (y1 - y0)
        if min(x % 1, 1 - x % 1, y % 1, 1 - y % 1) > 1e-6:
            assert (math.floor(y), math.floor(x)) in cells


def test_it_stops_where_the_room_ends():
    rows, cols = np.empty(3, dtype=np.int32), np.empty(3, dtype=np.int32)
    assert traverse(0.5, 0.5, 9.5, 0.5, rows, cols) == 3
    assert cols.tolist() == [0, 1, 2]
