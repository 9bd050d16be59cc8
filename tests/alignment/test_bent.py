"""Maps of other mappers: scales that are off, walls that are bent; and buildings that look the same turned around."""

from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from mrslam.alignment import Alignment, AlignmentConfig, Rejection, align
from mrslam.alignment.prepared import prepare
from mrslam.alignment.verification import decide
from mrslam.alignment.verification.bend import Bend
from mrslam.alignment.verification.bent_fits import BentFit, bent_fits
from mrslam.spatial import OccupancyGrid, se2
from tests.alignment.conftest import House

CELLS = np.array([-1, 0, 100], dtype=np.int8)
"""By state of a prepared map."""
T_B_WORLD = se2.transform(4.0, 7.0, math.radians(-110.0))


def warped(grid: OccupancyGrid, scale: float, bend_m: float) -> tuple[OccupancyGrid, Bend]:
    """Return the map drawn to another scale, its walls bent by ``bend_m`` over 10 m, and the bend."""
    b = prepare(grid, grid.resolution_m)
    x, y = np.arange(0.0, 45.0, 1.0), np.arange(0.0, 45.0, 1.0)
    (x0, y0), (xs, ys) = grid.origin_m, np.meshgrid(x, y)
    wave = 0.5 * bend_m * np.sin(xs * math.pi / 10.0)
    nodes = np.stack([(scale - 1.0) * xs, (scale - 1.0) * ys + wave], axis=-1)
    by = Bend(se2.IDENTITY, nodes, x0, y0, 1.0, 0.0)
    drawn = by.bent(b)
    return OccupancyGrid(CELLS[drawn.state], drawn.res, (drawn.x0, drawn.y0)), by


def parts() -> tuple[OccupancyGrid, OccupancyGrid]:
    house = House()
    return house.part(slice(0, 400), slice(0, 400), np.zeros(3)), house.part(slice(0, 400), slice(100, 520), T_B_WORLD)


@pytest.mark.parametrize(("scale", "bend_m"), [(1.03, 0.0), (1.0, 0.6), (0.975, 0.3)])
def test_maps_that_other_mappers_warped_fit_by_a_small_bend(scale: float, bend_m: float) -> None:
    a, straight = parts()
    b, by = warped(straight, scale, bend_m)
    found = align(a, b)
    assert isinstance(found, Alignment), found.reason
    places = np.random.default_rng(0).uniform((6.0, 1.0), (19.0, 19.0), (50, 2))  # world: known to both
    in_b = se2.apply(T_B_WORLD, places)
    off = np.hypot(*(se2.apply(found.T_a_b, in_b + by.shifts(in_b)) - places).T)
    assert off.mean() < 0.3
    assert 0.04 < found.evidence.bent_m < 0.4 and 0.005 < found.evidence.strain < 0.06
    # Its rigid transform is as sure as what it leaves over.
    assert math.sqrt(found.covariance[0, 0]) > 0.8 * found.evidence.bent_m
    assert math.sqrt(found.covariance[2, 2]) > 0.9 * found.evidence.bent_m / max(found.evidence.extent_m, 1.0)


def test_without_bending_warped_maps_are_refused() -> None:
    a, straight = parts()
    found = align(a, warped(straight, 1.03, 0.0)[0], config=AlignmentConfig(strain=0.0))
    assert isinstance(found, Rejection) and found.may_bend


def test_what_is_refused_bent_as_well_is_refused_in_the_words_of_the_maps_as_they_are() -> None:
    a, _ = parts()
    other = House(7).part(slice(0, 400), slice(100, 520), T_B_WORLD)
    bent, rigid = (align(a, other, config=AlignmentConfig(strain=strain)) for strain in (0.03, 0.0))
    assert isinstance(bent, Rejection) and isinstance(rigid, Rejection)
    assert bent.reason == rigid.reason and bent.evidence == rigid.evidence


def test_two_starts_that_are_bent_to_one_place_are_one_fit() -> None:
    a, straight = parts()
    b, _ = warped(straight, 0.985, 0.3)
    sides = [prepare(grid.cropped(), 0.05) for grid in (a, b)]
    truth = se2.inverse(T_B_WORLD)
    near = truth + np.array([0.3, -0.2, 0.0])
    found = bent_fits(sides[0], sides[1], [truth, near, truth + np.array([9.0, 4.0, 1.0])], AlignmentConfig())
    assert [fit.start for fit in found if fit.start < 2] in ([0], [1])


@pytest.mark.parametrize("is_first", [False, True])
def test_contradictions_of_either_map_count_under_a_bend(is_first: bool) -> None:
    empty = np.zeros((160, 200), dtype=np.int8)
    empty[[0, -1]], empty[:, [0, -1]] = 100, 100
    filled = empty.copy()
    filled[60:100, 80:120] = 100
    sides = [prepare(OccupancyGrid(cells, 0.05), 0.05) for cells in (empty, filled)]
    a, b = sides[::-1] if is_first else sides
    (fit,) = bent_fits(a, b, [se2.IDENTITY], AlignmentConfig())
    assert 5.0 < fit.case.contradicted_m < 9.0


def test_maps_that_fit_as_they_are_are_not_bent() -> None:
    found = align(*parts())
    assert isinstance(found, Alignment) and found.evidence.bent_m == 0.0 == found.evidence.strain


def symmetric() -> House:
    """Return a house that looks the same after half a turn."""
    house = House()
    house.cells = np.maximum(house.cells, house.cells[::-1, ::-1])
    return house


@pytest.mark.parametrize("scale", [1.0, 1.03])
def test_half_a_turn_in_a_symmetric_house_is_ambiguous_and_both_places_are_named(scale: float) -> None:
    house = symmetric()
    every = slice(0, 400), slice(0, 520)
    a, b = house.part(*every, np.zeros(3)), warped(house.part(*every, T_B_WORLD), scale, 0.0)[0]
    for one, two in ((a, b), (b, a)):
        found = align(one, two)
        assert isinstance(found, Rejection) and found.ambiguous, found
        assert "ambiguous" in found.reason
        turns = [math.degrees(abs(se2.wrap(T[2] - found.T_a_b[2]))) for T in found.rivals]
        assert turns[0] == pytest.approx(180.0, abs=2.0)
        # The rival lays the middle of the house where the best place does.
        middle = two.centres(two.is_occupied).mean(axis=0)
        assert np.hypot(*(se2.apply(found.rivals[0], middle) - se2.apply(found.T_a_b, middle))) < 1.0


def test_one_place_only_is_no_ambiguity() -> None:
    a, b = parts()
    blank = OccupancyGrid(np.where(b.is_occupied, np.int8(0), b.cells), b.resolution_m, b.origin_m)
    found = align(a, blank)
    assert isinstance(found, Rejection) and not found.ambiguous and found.rivals == ()


@pytest.mark.parametrize(("share", "ambiguous"), [(0.5, False), (0.95, True)])
def test_a_fit_that_is_not_clean_must_stand_against_places_that_are_bent(
    share: float, ambiguous: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    a, straight = parts()
    b, _ = warped(straight, 0.985, 0.3)
    assert isinstance(align(a, b), Alignment)  # as it is, though 9 % of the walls contradict

    def with_a_rival(*arguments: object) -> list[BentFit]:
        fits = bent_fits(*arguments)
        own = next(fit for fit in fits if fit.start == 0)
        case = replace(own.case, matched_m=share * own.case.matched_m, opposed_m=share * own.case.opposed_m)
        away = replace(own.bend, T_a_b=own.bend.T_a_b + np.array([9.0, 0.0, 0.0]))
        return [own, BentFit(replace(case, contradicted_m=share * case.contradicted_m), away, 99)]

    monkeypatch.setattr(decide, "bent_fits", with_a_rival)
    found = align(a, b)
    assert isinstance(found, Rejection) == ambiguous
    if ambiguous:
        assert len(found.rivals) == 1 and np.hypot(*(found.rivals[0] - found.T_a_b)[:2]) == pytest.approx(9.0, abs=0.6)


def test_of_two_halls_the_one_that_was_not_asked_for_is_never_the_answer_however_well_it_fits_when_bent() -> None:
    hall = House().cells[:, :394].copy()
    filled, rng = hall.copy(), np.random.default_rng(3)
    for _ in range(20):  # boxes in the hall that is asked for
        row, col = rng.integers(20, 360, 2)
        height, width = rng.integers(6, 16, 2)
        filled[row : row + height, col : col + width] = 100
    cells = np.full((400, 888), -1, np.int8)
    cells[:, :394], cells[:, 494:] = shell(filled), shell(hall)
    cells[196:204, 394:494] = 0  # a corridor
    wide = cv2.resize(shell(hall).view(np.uint8), None, fx=1.006, fy=1.006, interpolation=cv2.INTER_NEAREST)
    a, b = OccupancyGrid(cells, 0.05), OccupancyGrid(wide.view(np.int8), 0.05)
    place = se2.transform(-0.06, -0.06, 0.0)
    outcome = align(a, b, place=place, config=AlignmentConfig(min_margin=0.5))
    assert isinstance(outcome, Rejection) and outcome.T_a_b is not None
    assert se2.difference(outcome.T_a_b, place)[0] < 0.5


def shell(cells: np.ndarray) -> np.ndarray:
    """Return cells with the insides of walls unknown, as a laser sees them."""
    beside_floor = cv2.dilate((cells == 0).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    return np.where((cells == 100) & ~beside_floor, -1, cells).astype(np.int8)
