"""Places to look at where a prior is sure of where the maps lie."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig, Candidate, Prior
from mrslam.alignment.aligners import ALIGNERS
from mrslam.alignment.prepared import PreparedMap
from mrslam.alignment.proposals import search
from mrslam.alignment.proposals.lattice import APART_M, APART_RAD, MOST, PRIOR_SIGMAS, lattice
from mrslam.spatial import OccupancyGrid, se2

Sides = tuple[PreparedMap, PreparedMap]


def middles(b: PreparedMap, places: np.ndarray) -> np.ndarray:
    """Return where the middle of b's walls lies at each place."""
    return np.asarray(se2.apply(places, b.centre))


def swung(T_a_b: np.ndarray, at: np.ndarray, sigma_m: float, sigma_rad: float) -> np.ndarray:
    """Return the covariance of a transform of which it is known where it has a point, and its heading badly."""
    x, y = se2.apply(np.array([0.0, 0.0, T_a_b[2]]), at)
    J = np.array([[1.0, 0.0, y], [0.0, 1.0, -x], [0.0, 0.0, 1.0]])  # a turn about the point moves the origin
    return np.asarray(J @ np.diag([sigma_m, sigma_m, sigma_rad]) ** 2 @ J.T)


@pytest.mark.parametrize("is_swung", [False, True])
def test_whatever_a_prior_allows_has_a_place_of_the_lattice_next_to_it(sides: Sides, is_swung: bool) -> None:
    T, at = se2.transform(3.0, -2.0, 3.1), np.array([4.0, 1.0])
    C = swung(T, at, 0.2, 0.05) if is_swung else np.diag([0.25, 0.2, 0.04]) ** 2
    places = lattice(sides[1], Prior(T, C))
    assert places is not None and len(places) <= MOST and np.abs(places[:, 2]).max() <= math.pi
    rng = np.random.default_rng(3)
    for _ in range(50):
        u = rng.normal(size=3)
        true = T + np.linalg.cholesky(C) @ (u / np.linalg.norm(u) * rng.uniform(0.0, 0.85 * PRIOR_SIGMAS))
        off = places - true
        turn = np.abs(se2.wrap(off[:, 2]))
        here = places[turn == turn.min()]
        assert turn.min() <= 0.51 * APART_RAD
        away_m = np.hypot(*(middles(sides[1], here) - middles(sides[1], true)).T)
        assert away_m.min() <= 1.2 * APART_M


def test_nothing_farther_from_a_prior_than_its_sigmas_is_looked_at(sides: Sides) -> None:
    T, C = se2.transform(1.0, 2.0, -3.0), np.diag([0.3, 0.15, 0.05]) ** 2
    places = lattice(sides[1], Prior(T, C))
    assert places is not None
    off = places - T
    off[:, 2] = se2.wrap(off[:, 2])
    away = np.sqrt(np.einsum("ni,ni->n", off @ np.linalg.inv(C), off))
    assert 0.85 * PRIOR_SIGMAS < away.max() <= PRIOR_SIGMAS + 1e-6 and away.min() < 1e-6


def test_the_farther_walls_lie_from_the_origin_the_finer_is_the_heading(sides: Sides) -> None:
    b, C = sides[1], np.diag([1e-3, 1e-3, 0.01]) ** 2
    far = PreparedMap(b.state, b.x0 + 80.0, b.y0, b.res)
    near, spread = (lattice(side, Prior(se2.IDENTITY, C)) for side in (b, far))
    assert near is not None and spread is not None and len(spread) > 2 * len(near)
    steps_m = np.hypot(*np.diff(middles(far, spread[np.argsort(spread[:, 2])]), axis=0).T)
    assert steps_m.max() <= 1.05 * APART_M


def test_where_robots_met_far_from_where_a_map_begins_there_are_no_more_places(sides: Sides) -> None:
    b, T = sides[1], se2.transform(3.0, -2.0, 1.0)
    far = PreparedMap(b.state, b.x0 + 80.0, b.y0, b.res)
    here, there = (lattice(side, Prior(T, swung(T, side.centre, 0.2, 0.05))) for side in (b, far))
    assert here is not None and there is not None and len(there) < 1.1 * len(here)


@pytest.mark.parametrize("C", [np.diag([5.0, 5.0, 0.05]) ** 2, np.diag([0.5, 0.5, math.pi]) ** 2, 1e12 * np.eye(3)])
def test_of_a_vague_prior_there_is_no_lattice(sides: Sides, C: np.ndarray) -> None:
    assert lattice(sides[1], Prior(se2.IDENTITY, C)) is None


def test_as_many_places_as_cost_less_than_a_correlation_are_looked_at(sides: Sides) -> None:
    for sigma_m, is_lattice in ((0.4, True), (0.5, False)):
        places = lattice(sides[1], Prior(se2.IDENTITY, np.diag([sigma_m, sigma_m, 0.05]) ** 2))
        assert (places is not None) == is_lattice
        assert places is None or 0.5 * MOST < len(places) <= MOST


def test_a_prior_without_any_doubt_is_its_place_alone(sides: Sides) -> None:
    (place,) = lattice(sides[1], Prior(np.array([1.0, 2.0, 7.0]), np.zeros((3, 3))))  # type: ignore[misc]
    np.testing.assert_allclose(place, [1.0, 2.0, 7.0 - 2.0 * math.pi])


def test_where_robots_saw_each_other_maps_are_found_without_correlating_all_of_them(
    sides: Sides, pair: tuple[OccupancyGrid, OccupancyGrid, se2.Transform], monkeypatch: pytest.MonkeyPatch
) -> None:
    a, b = sides
    monkeypatch.setattr(search, "correlate", None)
    for off in ([0.5, -0.4, 0.1], [-0.3, 0.5, -0.15]):
        prior = Prior(pair[2] + np.array(off), np.diag([0.22, 0.22, 0.06]) ** 2)
        found: list[Candidate] = ALIGNERS["auto"](a, b, AlignmentConfig(), prior)
        assert np.hypot(*(middles(b, found[0].T_a_b) - middles(b, pair[2])).T) < 0.1
        at = np.stack([one.T_a_b for one in found])
        apart = np.hypot(*(middles(b, at)[:, None] - middles(b, at)[None]).transpose(2, 0, 1))
        turns = np.abs(se2.wrap(at[:, None, 2] - at[None, :, 2]))
        assert np.count_nonzero((apart < 0.3) & (turns < APART_RAD)) == len(at)  # each is near itself alone
