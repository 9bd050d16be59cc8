"""What is known before of where two maps lie: it narrows the search, and never decides against the walls."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mrslam import alignment
from mrslam.alignment import Alignment, AlignmentConfig, Prior, Rejection, align
from mrslam.alignment.prepared import prepare, working_resolution
from mrslam.alignment.proposals.lattice import lattice
from mrslam.spatial import InputError, OccupancyGrid, se2
from tests.alignment.apart import apart


def test_prior_picks_the_room_that_was_meant():
    room = np.zeros((80, 80), dtype=np.int8)
    room[0], room[-1], room[:, 0], room[:, -1], room[20:30, 30:50], room[60, 10:30] = 100, 100, 100, 100, 100, 100
    row = OccupancyGrid(np.concatenate([room] * 5, axis=1), 0.05)
    part = OccupancyGrid(row.cells[:, 160:320].copy(), 0.05)
    prior = Prior(np.array([8.2, 0.1, 0.02]), np.diag([0.2, 0.2, 0.05]) ** 2)
    found = align(row, part, prior=prior)
    assert isinstance(found, Alignment), found.reason
    np.testing.assert_allclose(found.T_a_b, [8.0, 0.0, 0.0], atol=0.05)


@pytest.mark.parametrize("is_turned", [False, True])
def test_a_place_without_a_heading_picks_the_room_that_was_meant(is_turned):
    room = np.zeros((80, 80), dtype=np.int8)
    room[0], room[-1], room[:, 0], room[:, -1], room[20:30, 30:50], room[60, 10:30] = 100, 100, 100, 100, 100, 100
    row = OccupancyGrid(np.concatenate([room] * 5, axis=1), 0.05)
    part = OccupancyGrid(row.cells[:, 160:320].copy(), 0.05)
    place = np.array([8.2, 0.1, 0.0]), np.diag([0.2, 0.2, np.pi]) ** 2
    if is_turned:  # where part lies in the row, asked for as where the row lies in part
        found = align(part, row, prior=Prior(*place, of_inverse=True))
        assert isinstance(found, Alignment), found.reason
        found_T = se2.inverse(found.T_a_b)
    else:
        found = align(row, part, prior=Prior(*place))
        assert isinstance(found, Alignment), found.reason
        found_T = found.T_a_b
    np.testing.assert_allclose(found_T, [8.0, 0.0, 0.0], atol=0.05)


@pytest.mark.parametrize("method", ["auto", "orb"])
def test_where_nothing_is_proposed_the_priors_own_place_is_examined(method, pair, monkeypatch):
    a, b, truth = pair
    monkeypatch.setitem(alignment.ALIGNERS, method, lambda *_: [])
    sure = np.diag([0.1, 0.1, 0.02]) ** 2
    here = align(a, b, method=method, prior=Prior(truth, sure))
    assert here.evidence is not None and here.evidence.contradiction < 0.05 < 5.0 < here.evidence.matched_m
    wrong = align(a, b, method=method, prior=Prior(truth + np.array([2.0, 0.0, 0.5]), sure))
    assert isinstance(wrong, Rejection) and wrong.evidence is not None and wrong.evidence.contradiction > 0.3
    assert align(a, b, method=method).evidence is None


@pytest.mark.parametrize("method", ["auto", "orb"])
def test_a_prior_that_is_too_sure_still_lets_walls_say_where_they_lie_to_a_cell(method, pair):
    a, b, truth = pair
    found = align(a, b, method=method, prior=Prior(truth + np.array([0.03, -0.02, 0.0]), np.zeros((3, 3))))
    assert isinstance(found, Alignment), found.reason
    assert apart(found.T_a_b, truth, b)[0] < 0.03


def test_wrong_prior_is_not_followed(pair):
    a, b, truth = pair
    prior = Prior(truth + np.array([6.0, 0.0, 0.0]), np.diag([0.2, 0.2, 0.05]) ** 2)
    assert isinstance(align(a, b, prior=prior), Rejection)


@pytest.mark.parametrize("method", ["auto", "orb", "hill-climb"])
def test_no_method_answers_outside_of_the_priors_window(method, pair):
    a, b, truth = pair
    sigma = np.diag([0.1, 0.1, 0.01])
    middle = b.centres(b.is_occupied).mean(axis=0)
    for off in ((3.0, 0.0, 0.0), (0.0, -3.0, 0.0), (0.0, 0.0, 0.5)):
        forth = se2.transform(*(se2.apply(truth, middle) + off[:2]), truth[2] + off[2])
        prior = Prior(se2.compose(forth, se2.transform(-middle[0], -middle[1], 0.0)), sigma**2)
        found = align(a, b, method=method, prior=prior, config=AlignmentConfig(evaluations=100))
        assert isinstance(found, Rejection)


def test_the_exhaustive_search_proposes_places_within_the_priors_window_alone(sides, pair):
    a, b = sides
    for off, is_true in ((0.0, True), (3.0, False)):
        prior = Prior(pair[2] + np.array([off, 0.0, 0.0]), np.diag([0.1, 0.1, 0.002]) ** 2)
        at = np.array(
            [se2.apply(c.T_a_b, b.centre) for c in alignment.ALIGNERS["auto"](a, b, AlignmentConfig(), prior)]
        )
        assert len(at) > 0
        assert np.hypot(*(at - se2.apply(prior.T_a_b, b.centre)).T).max() < 2.5
        assert (np.hypot(*(at - se2.apply(pair[2], b.centre)).T) < 0.2).any() == is_true


def test_a_heading_known_badly_moves_a_map_whose_content_is_far_from_its_origin_by_its_lever(pair):
    a, near, at_origin = pair
    b = OccupancyGrid(near.cells, near.resolution_m, (near.origin_m[0] + 60.0, near.origin_m[1]))
    truth = se2.compose(at_origin, se2.transform(-60.0, 0.0, 0.0))
    prior = Prior(truth + np.array([0.1, -0.1, 0.1]), np.diag([0.2, 0.2, 0.06]) ** 2)  # 6 m off where the walls are
    for one, other, where, T in ((a, b, prior, truth), (b, a, replace(prior, of_inverse=True), se2.inverse(truth))):
        found = align(one, other, prior=where)
        assert isinstance(found, Alignment), found.reason
        middle = other.centres(other.is_occupied).mean(axis=0)
        assert np.hypot(*(se2.apply(found.T_a_b, middle) - se2.apply(T, middle))) < 0.1
    resolution_m = working_resolution(a, b, AlignmentConfig())
    sides = prepare(a.cropped(), resolution_m), prepare(b.cropped(), resolution_m)
    vague = Prior(truth + np.array([0.1, -0.1, 0.2]), np.diag([0.5, 0.5, 0.2]) ** 2)
    for known, is_sure in ((prior, True), (vague, False)):
        assert (lattice(sides[1], known) is not None) == is_sure
        proposed = alignment.ALIGNERS["auto"](*sides, AlignmentConfig(), known)
        at = np.array([se2.apply(c.T_a_b, sides[1].centre) for c in proposed])
        assert np.hypot(*(at - se2.apply(truth, sides[1].centre)).T).min() < 0.2


@pytest.mark.parametrize("turns", [-1.0, 1.0])
def test_a_prior_means_its_heading_however_many_turns_it_is_told_with(turns, pair):
    a, b, truth = pair
    for one, other, T in ((a, b, truth), (b, a, se2.inverse(truth))):
        # Farther off than walls draw a map: it is found only where candidates count as within the prior.
        prior = Prior(T + np.array([1.0, -0.9, 2.0 * np.pi * turns]), np.diag([0.5, 0.5, 0.05]) ** 2)
        found = align(one, other, prior=prior)
        assert isinstance(found, Alignment), found.reason
        assert apart(found.T_a_b, T, other)[0] < 0.05


@pytest.mark.parametrize("bad", [np.zeros(2), np.array([0, 0, math.nan])])
def test_prior_must_make_sense(bad):
    with pytest.raises(InputError, match="prior's T_a_b must be three finite numbers"):
        Prior(bad, np.eye(3))
    with pytest.raises(InputError, match="covariance"):
        Prior(np.zeros(3), -np.eye(3))
