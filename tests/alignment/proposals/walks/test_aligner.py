"""The searches as aligners: what they propose for two maps, and within which bounds."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment import ALIGNERS, AlignmentConfig, Prior
from mrslam.alignment.prepared import prepare
from mrslam.alignment.proposals.dissimilarity import Dissimilarity
from mrslam.alignment.proposals.walks import about, bounds
from mrslam.alignment.proposals.walks.aligner import APART_M, APART_RAD, KEPT
from mrslam.spatial import OccupancyGrid, se2

FAMILY = [
    "random-walk",
    "plain-walk",
    "multi-point-hill-climb",
    "hill-climb",
    "simulated-annealing",
    "annealing",
    "brute-force",
]


@pytest.mark.parametrize("method", FAMILY)
def test_the_least_dissimilar_distinct_places_are_proposed_best_first(method, sides):
    a, b = sides
    found = ALIGNERS[method](a, b, AlignmentConfig(evaluations=150), None)
    assert 1 < len(found) <= KEPT
    scores = [candidate.score for candidate in found]
    assert scores == sorted(scores, reverse=True)
    psi = Dissimilarity(a, b)
    assert psi(found[0].T_a_b) == pytest.approx(-found[0].score)
    for k, one in enumerate(found):
        for other in found[:k]:
            gap = se2.apply(one.T_a_b, b.centre) - se2.apply(other.T_a_b, b.centre)
            turn = abs(float(se2.wrap(one.T_a_b[2] - other.T_a_b[2])))
            assert math.hypot(*gap) > APART_M or turn > APART_RAD


@pytest.mark.parametrize("method", FAMILY)
def test_maps_of_one_place_are_laid_on_each_other(method, house):
    whole, T_a_b = (slice(0, 400), slice(0, 520)), se2.transform(0.8, -0.6, 0.2)
    a = prepare(house.part(*whole, np.zeros(3)).cropped(), 0.1)
    b = prepare(house.part(*whole, se2.inverse(T_a_b)).cropped(), 0.1)
    prior = Prior(se2.transform(0.2, -0.3, 0.15), np.diag([0.5, 0.5, 0.05]) ** 2)
    best = ALIGNERS[method](a, b, AlignmentConfig(evaluations=600), prior)[0]
    assert math.hypot(*(se2.apply(best.T_a_b, b.centre) - se2.apply(T_a_b, b.centre))) < 0.4
    assert abs(float(se2.wrap(best.T_a_b[2] - T_a_b[2]))) < math.radians(4.0)


def test_a_prior_bounds_the_search_about_itself(sides, pair):
    a, b = sides
    start, low, high = bounds(a, b, Prior(pair[2], np.diag([0.3, 0.3, 0.002]) ** 2))
    np.testing.assert_allclose(se2.difference(about(start, b), pair[2]), 0.0, atol=1e-9)
    assert ((start - low) > 3.0 * np.array([0.3, 0.3, 0.002])).all()
    assert ((high - low) < (4.0, 4.0, 0.1)).all()
    np.testing.assert_allclose(0.5 * (low + high), start)
    _, low, high = bounds(a, b, None)
    assert ((high - low)[:2] > 10.0).all() and high[2] - low[2] == pytest.approx(2.0 * math.pi)


def test_a_heading_known_badly_widens_the_search_by_the_lever_of_what_is_far_from_the_origin(sides, pair):
    a, near = sides[0], pair[1]
    far = OccupancyGrid(near.cells, near.resolution_m, (near.origin_m[0] + 60.0, near.origin_m[1]))
    b = prepare(far, a.res)
    truth = se2.compose(pair[2], se2.transform(-60.0, 0.0, 0.0))
    _, low, high = bounds(a, b, Prior(truth + np.array([0.0, 0.0, 0.1]), np.diag([0.2, 0.2, 0.06]) ** 2))
    middle = np.append(se2.apply(truth, b.centre), truth[2])
    assert (low < middle).all() and (middle < high).all()
    assert ((high - low)[:2] < 2.0 * 3.0 * (0.2 + 0.06 * 75.0)).all()
