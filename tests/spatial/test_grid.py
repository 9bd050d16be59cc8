import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from mrslam.spatial import UNKNOWN, InputError, OccupancyGrid

cells_strategy = arrays(np.int8, st.tuples(st.integers(0, 12), st.integers(0, 12)), elements=st.integers(-1, 100))


@pytest.mark.parametrize(
    ("cells", "message"),
    [
        (np.zeros(3, dtype=np.int8), r"shape \(H, W\)"),
        (np.zeros((2, 2), dtype=np.uint8), "int8"),
        (np.full((2, 2), -2, dtype=np.int8), "-1..100, got -2"),
        (np.full((2, 2), 101, dtype=np.int8), "got 101..101"),
    ],
)
def test_cells_that_are_no_occupancy_are_refused(cells, message):
    with pytest.raises(InputError, match=message):
        OccupancyGrid(cells, 0.05)


@pytest.mark.parametrize("resolution", [0.0, -0.05, 1e-300, 1e300, np.nan, np.inf])
def test_resolutions_must_be_within_bounds(resolution):
    with pytest.raises(InputError, match=r"resolution must be in 0.001..100 m"):
        OccupancyGrid(np.zeros((1, 1), dtype=np.int8), resolution)


def test_origins_must_be_finite():
    with pytest.raises(InputError, match="origin must be finite"):
        OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, (0.0, np.nan))
    with pytest.raises(InputError, match=r"within 1e\+08 m"):
        OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, (-1e300, 0.0))


@given(cells_strategy)
def test_every_known_cell_is_free_occupied_or_in_between(cells):
    grid = OccupancyGrid(cells, 0.05)
    assert not (grid.is_free & grid.is_occupied).any()
    assert (grid.is_known == (cells >= 0)).all()
    assert grid.known_area_m2() == pytest.approx((cells >= 0).sum() * 0.0025)


@given(st.integers(-500, 500), st.integers(-500, 500), st.sampled_from([0.01, 0.02, 0.025, 0.05, 0.1, 0.3]))
def test_grids_made_at_a_cell_know_it_again(row, col, resolution):
    grid = OccupancyGrid.at_cell(np.zeros((2, 3), dtype=np.int8), resolution, row, col)
    assert grid.on_lattice
    assert grid.cell0 == (row, col)
    np.testing.assert_allclose(
        grid.centres(np.ones((2, 3), dtype=bool))[-1], [(col + 2.5) * resolution, (row + 1.5) * resolution], atol=1e-9
    )


def test_an_origin_between_cells_is_not_on_the_lattice():
    assert not OccupancyGrid(np.zeros((1, 1), dtype=np.int8), 0.05, (0.02, 0.0)).on_lattice


@given(cells_strategy, st.integers(0, 3))
def test_cropping_keeps_every_known_cell_in_its_place(cells, margin):
    grid = OccupancyGrid(cells, 0.1, (1.0, -2.0))
    crop = grid.cropped(margin)
    np.testing.assert_allclose(crop.centres(crop.is_known), grid.centres(grid.is_known), atol=1e-9)
    np.testing.assert_array_equal(crop.cells[crop.is_known], grid.cells[grid.is_known])
    if crop.cells.size:
        inner = crop.cells[margin : crop.shape[0] - margin, margin : crop.shape[1] - margin]
        assert (inner[[0, -1]] != UNKNOWN).any(axis=1).all()
        assert (inner[:, [0, -1]] != UNKNOWN).any(axis=0).all()


def test_cropping_nothing_known_gives_nothing():
    assert OccupancyGrid(np.full((4, 4), UNKNOWN, dtype=np.int8), 0.05).cropped(2).shape == (0, 0)


@pytest.mark.parametrize(
    ("origin_m", "is_on"), [((0.1, -0.15), True), ((0.12, -0.15), False), ((0.1, -0.13), False), ((0.0, 0.0), True)]
)
def test_origins_on_the_lattice_are_whole_cells_in_both_directions(origin_m, is_on):
    assert OccupancyGrid(np.zeros((2, 3), dtype=np.int8), 0.05, origin_m).on_lattice is is_on
