"""Laying walls on walls: slope, way back, and how sure the result is."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment.verification.refine import equations, refine
from mrslam.spatial import se2


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
