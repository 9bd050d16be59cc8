"""Laying walls on walls: slope, way back, and how sure the result is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment.prepared import prepare
from mrslam.alignment.verification.refine import carried, covariance, equations, refine
from mrslam.spatial import OccupancyGrid, se2


def test_gradient_is_the_slope_of_the_cost(sides, pair):
    a, b = sides
    pivot = se2.apply(pair[2], b.centre)
    # Near the truth no point changes its partner, and with a wide kernel the cost is the plain sum of squares.
    T = se2.compose(pair[2], np.array([0.01, 0.005, 0.001]))
    scale = 50.0
    _, g, _, _ = equations(a, b, T, pivot, 0.6, scale)
    away = np.zeros(3)
    for k in range(3):
        costs = []
        for sign in (1, -1):
            shift = np.zeros(3)
            shift[k] = sign * 1e-8
            forth = np.array([pivot[0] + shift[0], pivot[1] + shift[1], shift[2]])
            moved = se2.compose(se2.compose(forth, [-pivot[0], -pivot[1], 0.0]), T)
            costs.append(equations(a, b, moved, pivot, 0.6, scale)[3] * scale**2)
        away[k] = (costs[0] - costs[1]) / 2e-8 / 2.0
    np.testing.assert_allclose(away, g, rtol=0.1, atol=0.05 * np.abs(g).max())


@pytest.mark.parametrize("off", [(0.2, -0.15, 0.02), (-0.3, 0.2, -0.03)])
def test_refinement_comes_back(sides, pair, off):
    a, b = sides
    pivot = se2.apply(pair[2], b.centre)
    forth = np.array([pivot[0] + off[0], pivot[1] + off[1], off[2]])
    start = se2.compose(se2.compose(forth, [-pivot[0], -pivot[1], 0.0]), pair[2])
    found = refine(a, b, start)
    assert np.hypot(*(se2.apply(found, b.centre) - pivot)) < 0.03
    assert abs(se2.wrap(found[2] - pair[2][2])) < math.radians(0.2)


def test_the_covariance_is_that_of_as_many_independent_readings_as_walls_hold():
    """A room of 8 x 6 m laid on itself: its walls' points, in both directions, one in five of them independent."""
    cells = np.zeros((120, 160), dtype=np.int8)
    cells[[0, -1]], cells[:, [0, -1]] = 100, 100
    side = prepare(OccupancyGrid(cells, 0.05, (-4.0, -3.0)), 0.05)
    sigma_m = 0.075
    H, _, used, _ = equations(side, side, se2.IDENTITY, side.centre, 0.15, 1.0)
    C = covariance(H, side.centre, se2.IDENTITY, sigma_m)
    facing_x, facing_y = (2 * np.count_nonzero(np.abs(side.normals[:, k]) > 0.9) for k in (0, 1))
    assert used > 1000 and facing_y > 1.2 * facing_x > 500
    assert C[0, 0] == pytest.approx(5.0 * sigma_m**2 / facing_x, rel=0.1)
    assert C[1, 1] == pytest.approx(5.0 * sigma_m**2 / facing_y, rel=0.1)
    (x, y), (nx, ny) = (side.points - side.centre).T, side.normals.T
    lever2 = ((x * ny - y * nx) ** 2).sum()
    assert C[2, 2] == pytest.approx(5.0 * sigma_m**2 / (2.0 * lever2), rel=0.1)


def test_the_covariance_of_a_frame_far_from_the_walls_grows_by_the_lever():
    H = np.diag([1000.0, 1000.0, 9000.0])
    near, far = (covariance(H, np.zeros(2), np.array([x, 0.0, 0.0]), 0.075) for x in (0.0, 50.0))
    assert far[1, 1] == pytest.approx(near[1, 1] + 50.0**2 * near[2, 2]) and far[0, 0] == pytest.approx(near[0, 0])
    assert far[1, 2] == pytest.approx(50.0 * near[2, 2])
    beside = covariance(H, np.zeros(2), np.array([0.0, 50.0, 0.0]), 0.075)
    assert beside[0, 2] == pytest.approx(-50.0 * near[2, 2]) and beside[1, 2] == pytest.approx(0.0, abs=1e-9)


def test_a_turn_about_the_walls_moves_an_origin_that_is_far_from_them():
    T_a_b, pivot = se2.transform(200.0, 30.0, 0.4), np.array([3.0, -4.0])
    C = carried(np.diag([0.09, 0.09, 0.0009]), pivot, T_a_b)
    lever = se2.apply(se2.inverse(T_a_b), pivot)  # the walls, frame b
    x, y = se2.matrix(T_a_b)[:2, :2] @ lever
    J = np.array([[1.0, 0.0, -y], [0.0, 1.0, x]])
    np.testing.assert_allclose(J @ C @ J.T, np.diag([0.09, 0.09]), atol=1e-9)
