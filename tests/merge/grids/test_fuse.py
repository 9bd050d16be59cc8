import itertools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrslam.merge import fuse
from mrslam.merge.config import FUSIONS
from mrslam.merge.grids.fuse import fuse_evidence, to_cells, to_evidence
from mrslam.spatial import UNKNOWN, InputError, OccupancyGrid

percent = st.one_of(st.just(-1), st.integers(0, 100))


def layers_of(count: int, elements=percent):
    cell0 = st.integers(-5, 5)
    grid = st.builds(
        lambda cells, row, col: OccupancyGrid.at_cell(cells, 0.05, row, col),
        arrays(np.int8, st.tuples(st.integers(1, 6), st.integers(1, 6)), elements=elements),
        cell0,
        cell0,
    )
    return st.lists(grid, min_size=count, max_size=count)


def value_at(grid: OccupancyGrid, row: int, col: int) -> int:
    r, c = row - grid.cell0[0], col - grid.cell0[1]
    return int(grid.cells[r, c]) if 0 <= r < grid.shape[0] and 0 <= c < grid.shape[1] else UNKNOWN


def naive(values: list[int], method: str) -> float:
    """What one cell should be: unknown counts for nothing."""
    known = [v for v in values if v != UNKNOWN]
    if not known:
        return UNKNOWN
    if method == "max":
        return max(known)
    if method == "mean":
        return sum(known) / len(known)
    p = np.clip(known, 3, 97) / 100
    odds = float(np.sum(np.log(p / (1 - p))))
    fused = 100 / (1 + np.exp(-odds))
    return 0 if fused <= 3.01 else 100 if fused >= 96.99 else fused


@pytest.mark.parametrize("method", FUSIONS)
@settings(max_examples=50, deadline=None)
@given(layers=layers_of(3))
def test_each_cell_is_what_the_slow_twin_says(method, layers):
    fused = fuse(layers, method)
    for r, c in np.ndindex(fused.shape):
        row, col = r + fused.cell0[0], c + fused.cell0[1]
        wanted = naive([value_at(layer, row, col) for layer in layers], method)
        if wanted == UNKNOWN or fused.cells[r, c] == UNKNOWN:
            assert fused.cells[r, c] == wanted
        else:
            assert abs(fused.cells[r, c] - wanted) <= 1


@pytest.mark.parametrize("method", FUSIONS)
@settings(max_examples=40, deadline=None)
@given(layers=layers_of(4))
def test_any_order_gives_the_same_bytes(method, layers):
    first = fuse(layers, method)
    for order in itertools.permutations(layers):
        again = fuse(order, method)
        assert again.cells.tobytes() == first.cells.tobytes()
        assert again.origin_m == first.origin_m


@pytest.mark.parametrize(("method", "tolerance"), [("log-odds", 1), ("max", 0)])
@settings(max_examples=60, deadline=None)
@given(layers=layers_of(3, elements=st.one_of(st.just(-1), st.integers(10, 90))))
def test_fusing_pairs_first_changes_nothing_beyond_rounding(method, tolerance, layers):
    """Percent is a coarse scale near its ends, so log-odds are compared where a step of it is a step of evidence."""
    a, b, c = layers
    left, right = fuse([fuse([a, b], method), c], method), fuse([a, fuse([b, c], method)], method)
    for row in range(left.cell0[0], left.cell0[0] + left.shape[0]):
        for col in range(left.cell0[1], left.cell0[1] + left.shape[1]):
            one, two = value_at(left, row, col), value_at(right, row, col)
            assert (one == UNKNOWN) == (two == UNKNOWN)
            if all(3 < value_at(pair, row, col) < 97 for pair in (fuse([a, b], method), fuse([b, c], method))):
                assert abs(one - two) <= 3 * tolerance
            assert (not (one <= 35 and two >= 65) and not (two <= 35 and one >= 65)) or method == "log-odds"


@pytest.mark.parametrize("method", FUSIONS)
@given(st.lists(st.integers(-1, 100), min_size=1, max_size=40))
def test_evidence_is_exactly_associative(method, values):
    parts = [to_evidence(np.array([[v]], dtype=np.int8), method) for v in values]
    left = parts[0]
    for one in parts[1:]:
        left = fuse_evidence(left, one, method)
    right = parts[-1]
    for one in parts[-2::-1]:
        right = fuse_evidence(one, right, method)
    assert left[0, 0] == right[0, 0]


@pytest.mark.parametrize("method", FUSIONS)
@given(value=st.integers(0, 100))
def test_unknown_never_overwrites_known(method, value):
    known = OccupancyGrid(np.array([[value, -1]], dtype=np.int8), 0.05)
    unknown = OccupancyGrid(np.full((3, 3), UNKNOWN, dtype=np.int8), 0.05)
    for layers in ([known, unknown], [unknown, known], [unknown, known, unknown]):
        fused = fuse(layers, method)
        expected = value if method != "log-odds" or 3 < value < 97 else (0 if value <= 3 else 100)
        assert fused.cells[0, 0] == expected
        assert np.count_nonzero(fused.is_known) == 1


def test_evidence_adds_up_and_stays_revisable():
    wall, free = (OccupancyGrid(np.array([[v]], dtype=np.int8), 0.05) for v in (80, 20))
    assert fuse([wall, wall]).cells[0, 0] > 90
    assert fuse([wall, free]).cells[0, 0] == 50
    assert fuse([wall, free, free]).cells[0, 0] == 20
    sure = OccupancyGrid(np.array([[100]], dtype=np.int8), 0.05)
    assert fuse([sure, *[OccupancyGrid(np.array([[0]], dtype=np.int8), 0.05)] * 2]).cells[0, 0] == 0


@pytest.mark.parametrize("method", FUSIONS)
def test_reading_cells_back_gives_what_was_put_in(method):
    cells = np.arange(-1, 101, dtype=np.int8)[None]
    back = to_cells(to_evidence(cells, method), method)
    wanted = np.where((cells >= 0) & (cells <= 3), 0, np.where(cells >= 97, 100, cells))
    np.testing.assert_array_equal(back, wanted if method == "log-odds" else cells)


def test_what_does_not_fit_together_is_refused_in_words():
    one = OccupancyGrid(np.zeros((2, 2), dtype=np.int8), 0.05)
    with pytest.raises(InputError, match="nothing to fuse"):
        fuse([])
    with pytest.raises(InputError, match="one resolution"):
        fuse([one, OccupancyGrid(one.cells, 0.1)])
    with pytest.raises(InputError, match="not on the lattice"):
        fuse([one, OccupancyGrid(one.cells, 0.05, (0.02, 0.0))])
    with pytest.raises(InputError, match="one of log-odds, max, mean"):
        fuse([one], "median")


def test_empty_layers_add_nothing():
    empty = OccupancyGrid(np.empty((0, 0), dtype=np.int8), 0.05)
    assert fuse([empty]).shape == (0, 0)
    one = OccupancyGrid(np.zeros((2, 2), dtype=np.int8), 0.05)
    np.testing.assert_array_equal(fuse([empty, one]).cells, one.cells)
