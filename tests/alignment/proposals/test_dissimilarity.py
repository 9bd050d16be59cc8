"""The dissimilarity psi."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.prepared import prepare
from mrslam.alignment.proposals.dissimilarity import Dissimilarity, mean_distance
from mrslam.spatial import OccupancyGrid, se2


def test_mean_distance_like_its_twin():
    rng = np.random.default_rng(4)
    field = rng.integers(0, 9, (12, 15)).astype(np.int32)
    points = rng.uniform(-2, 5, (30, 2))
    T = np.array([0.3, -0.2, 0.7])
    total = 0.0
    for p in se2.apply(T, points):
        c, r = int(math.floor((p[0] - 0.1) / 0.2)), int(math.floor((p[1] + 0.3) / 0.2))
        rr, cc = min(max(r, 0), 11), min(max(c, 0), 14)
        total += abs(r - rr) + abs(c - cc) + field[rr, cc]
    assert math.isclose(mean_distance(points, T, field, 0.1, -0.3, 0.2), total / 30)


def test_dissimilarity_is_symmetric_and_least_at_the_truth(house):
    whole = house.part(slice(0, 400), slice(0, 520), np.zeros(3)).cropped()
    side = prepare(whole, 0.05)
    psi = Dissimilarity(side, side)
    off = np.array([0.7, -0.4, 0.3])
    assert psi(np.zeros(3)) < 0.1 < psi(np.array([0.4, 0.0, 0.0])) < psi(np.array([3.0, 0.0, 0.0]))
    assert math.isclose(psi(off), psi(se2.inverse(off)), rel_tol=1e-9)


def test_maps_of_large_cells_are_compared_by_their_own_cells():
    cells = np.zeros((300, 300), np.int8)
    cells[100:110] = 100
    one = prepare(OccupancyGrid(cells, 5.0), 5.0)
    psi = Dissimilarity(one, one)
    assert max(max(field.shape) for side in psi.sides for field in side.fields) < 400
    assert psi(np.zeros(3)) < psi(np.array([0.0, 20.0, 0.0]))


def test_a_cell_that_holds_a_wall_is_not_free_as_well(sides):
    for side in Dissimilarity(*sides).sides:
        free, occupied = ({tuple(at) for at in points.tolist()} for points in side.points)
        assert free and occupied and free.isdisjoint(occupied)
