"""Shifts by FFT."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.kernels import correlation as correlate_kernels
from mrslam.alignment.prepared import prepare
from mrslam.alignment.proposals import correlate
from mrslam.spatial import OccupancyGrid, se2


def test_spectrum_of_the_rows_in_use_is_that_of_the_picture(sides):
    side = sides[1]
    free = correlate.free_points(side, 0.1) - side.centre
    picture = correlate.Picture(side.points - side.centre, side.normals, free)
    whole = np.zeros((5, 400, 405), dtype=np.float32)
    cos, sin = math.cos(0.3), math.sin(0.3)
    correlate_kernels.cyclic_splat(picture.points, picture.normals, cos, sin, 0.2, 0, whole[:4])
    correlate_kernels.soft_cap(whole[:4], 3.0)
    correlate_kernels.cyclic_count(picture.free, cos, sin, 0.2, 0.5, 0, whole[4])
    got = picture.spectra(0.3, 0.2, (400, 405), 3.0, 0.5)
    np.testing.assert_allclose(got, np.fft.rfft2(whole), atol=1e-3 * np.abs(got).max())


def test_maps_that_share_only_their_far_ends_are_proposed():
    cells = np.full((100, 1400), -1, dtype=np.int8)
    cells[:, 4:-4] = 0
    rng = np.random.default_rng(0)
    for left in [*rng.integers(10, 90, 300), *rng.integers(1310, 1390, 300)]:  # most of their walls
        row = int(rng.integers(8, 90))
        cells[row : row + 2, left : left + 2] = 100
    for left in (650, 683, 690):  # what they share
        cells[20 : left - 600, left : left + 4] = 100
    a = prepare(OccupancyGrid(cells[:, :770].copy(), 0.05), 0.05)
    b = prepare(OccupancyGrid(cells[:, 620:].copy(), 0.05), 0.05)
    found = correlate.correlate(a, b, [0.0], 0.2, per_angle=40, against=2.0)
    assert min(np.hypot(*(c.T_a_b[:2] - (31.0, 0.0))) for c in found) < 0.2


def rooms(box: bool) -> OccupancyGrid:
    """Return a room, with a box in the middle or without."""
    cells = np.zeros((80, 120), dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    if box:
        cells[30:50, 50:70] = 100
    return OccupancyGrid(np.pad(cells, 4, constant_values=-1), 0.05)


def test_walls_of_either_map_on_free_space_of_the_other_speak_against_a_place() -> None:
    empty, filled = prepare(rooms(False), 0.05), prepare(rooms(True), 0.05)
    for a, b in ((empty, filled), (filled, empty)):
        kind, strict = (correlate.correlate(a, b, [0.0], 0.2, against=against)[0] for against in (0.0, 1.0))
        for one in (kind, strict):
            assert np.hypot(*one.T_a_b[:2]) < 0.1
        # The box has 4 m of wall; half of it and more lies where the walls' blur does not reach.
        assert 2.0 < kind.score - strict.score < 6.0
    same = [correlate.correlate(filled, filled, [0.0], 0.2, against=against)[0].score for against in (0.0, 1.0)]
    assert abs(same[0] - same[1]) < 1.0


def test_shifts_come_best_first_and_only_where_the_middle_may_lie(sides) -> None:
    a, b = sides
    every = correlate.correlate(a, b, [0.1, 1.2], 0.2)
    scores = [one.score for one in every]
    assert scores == sorted(scores, reverse=True) and len(every) > 20
    near = (se2.apply(every[5].T_a_b, b.centre), 1.0)
    for one in correlate.correlate(a, b, [0.1, 1.2], 0.2, near=near):
        assert np.hypot(*(se2.apply(one.T_a_b, b.centre) - near[0])) < 1.5


def drawn(res: float, *, box: bool) -> OccupancyGrid:
    """Return a room of 6 m x 4 m with walls of one cell, with a box of 2 m x 2 m in the middle or without."""
    cells = np.zeros((round(4.0 / res), round(6.0 / res)), dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    if box:
        cells[round(1.0 / res) : round(3.0 / res), round(2.0 / res) : round(4.0 / res)] = 100
    return OccupancyGrid(np.pad(cells, 4, constant_values=-1), res)


def test_walls_on_walls_and_walls_on_free_space_weigh_as_much_whatever_the_cells() -> None:
    scores = []
    for res, cell_m in ((0.05, 0.2), (0.1, 0.2), (0.1, 0.4), (0.2, 0.4)):
        empty, filled = prepare(drawn(res, box=False), res), prepare(drawn(res, box=True), res)
        kind, strict = (
            correlate.correlate(empty, filled, [0.0], cell_m, blur_m=0.75 * cell_m, against=against)[0].score
            for against in (0.0, 1.0)
        )
        scores.append((kind, kind - strict))
    agree, contradict = np.array(scores).T
    assert agree.max() < 1.4 * agree.min() and contradict.max() < 1.4 * contradict.min()
