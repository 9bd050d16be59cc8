"""Matches along corridors: what recesses say, and that bare walls say nothing."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.hits.views import Tiles
from mrslam.spatial.matching.gauss_newton import match
from mrslam.spatial.matching.sliding import STEP_M, Drift, _sharpness, slid

SIGMA_M = 0.03


def corridor(recesses: tuple[float, ...], half_m: float) -> NDArray[np.float64]:
    """Points ``(N, 5)`` of a corridor along x, 2 m wide and twice ``half_m`` long, with recesses 0.4 m deep."""
    x = np.arange(-half_m, half_m, 0.04)
    in_recess = (
        np.any([np.abs(x - middle) < 0.6 for middle in recesses], axis=0) if recesses else np.zeros(x.size, bool)
    )
    upper = np.stack([x, np.where(in_recess, 1.4, 1.0), 0 * x, 0 * x - 1.0, 0 * x + 1.0], axis=1)
    lower = np.stack([x, np.where(in_recess, -1.4, -1.0), 0 * x, 0 * x + 1.0, 0 * x + 1.0], axis=1)
    return np.concatenate([upper, lower])


def drawn(recesses: tuple[float, ...]) -> Tiles:
    """Return the map of a corridor."""
    store = TileStore(1, 0.05)
    store.cover(np.full(2, -15.0), np.full(2, 15.0))
    store.draw(0, np.zeros((1, 2)), np.zeros((1, 3)), [corridor(recesses, 8.0)], 0.1)
    return store.tiles(0)


def compared(recesses: tuple[float, ...], off_m: float, sigma_m: float) -> tuple[float, float]:
    """Slide a scan of a corridor that is ``off_m`` from its place; return where it ends, and the information there."""
    tiles, points = drawn(recesses), corridor(recesses, 4.0)
    expected, prior = np.array([off_m, 0.0, 0.0]), np.diag([sigma_m**-2, sigma_m**-2, 2500.0])
    found = match(tiles, points, expected, expected, prior, SIGMA_M, 12)
    found, along = slid(tiles, points, found, Drift(expected, sigma_m, prior, 2.0), SIGMA_M)
    assert found.information[0, 0] < 1e-3 * found.information[1, 1]
    assert abs(along[1, 1]) < 1e-6
    return float(found.pose[0]), float(along[0, 0])


@pytest.mark.parametrize("off_m", [0.8, -1.2])
def test_recesses_show_how_far_along_a_corridor_the_scan_lies(off_m: float) -> None:
    at_m, information = compared((-2.5, -0.3, 2.9), off_m, 1.0)
    assert abs(at_m) < 0.06
    assert information > 0.7**-2


def test_a_place_is_not_believed_against_what_can_have_drifted() -> None:
    at_m, _ = compared((-2.5, -0.3, 2.9), 1.5, 0.1)
    assert abs(at_m - 1.5) < 0.5


def test_bare_walls_say_nothing_along_them() -> None:
    at_m, information = compared((), 0.6, 0.2)
    assert abs(at_m - 0.6) < 0.15
    assert information < 1.0


def test_along_bare_walls_a_scan_goes_back_to_where_it_is_expected() -> None:
    tiles = drawn(())
    expected, prior = np.zeros(3), np.diag([0.2**-2, 0.2**-2, 2500.0])
    start = np.array([0.6, 0.0, 0.0])  # where a search that knows no drift may have put it
    found = match(tiles, corridor((), 4.0), start, start, np.diag([1.0, 1.0, 1.0]), SIGMA_M, 12)
    assert found.pose[0] == pytest.approx(0.6, abs=0.2)
    found, _ = slid(tiles, corridor((), 4.0), found, Drift(expected, 0.2, prior, 2.0), SIGMA_M)
    assert abs(found.pose[0]) < 0.15


@pytest.mark.parametrize("off_m", [0.8, -1.2])
def test_the_last_place_that_was_tried_says_nothing_of_how_far_along_the_scan_lies(off_m: float) -> None:
    tiles, points = drawn((-2.5, -0.3, 2.9)), corridor((-2.5, -0.3, 2.9), 4.0)
    expected, prior = np.array([off_m, 0.0, 0.0]), np.diag([1.0, 1.0, 2500.0])
    found = match(tiles, points, expected, expected, prior, SIGMA_M, 0)
    _, along = slid(tiles, points, found, Drift(expected, 1.0, prior, 0.5), SIGMA_M)
    assert not along.any()


def test_what_descent_found_along_a_corridor_is_left_out() -> None:
    tiles, points = drawn((-2.5, -0.3, 2.9)), corridor((-2.5, -0.3, 2.9), 4.0)
    at, prior = np.zeros(3), np.diag([1.0, 1.0, 2500.0])
    said = np.array([[50.0, 0.0, 9.0], [0.0, 1e5, 7.0], [9.0, 7.0, 1e6]])
    found = match(tiles, points, at, at, prior, SIGMA_M, 12)._replace(information=said)
    found, _ = slid(tiles, points, found, Drift(at, 1.0, prior, 0.0), SIGMA_M)
    assert found.information == pytest.approx(np.array([[0.0, 0.0, 0.0], [0.0, 1e5, 7.0], [0.0, 7.0, 1e6]]))


def test_places_a_step_apart_say_no_more_than_the_step() -> None:
    said = _sharpness(np.array([-900.0, 0.0, -900.0]), STEP_M * np.arange(-1, 2))
    assert said == pytest.approx(12.0 / STEP_M**2)  # of a place that may be anywhere within a step
