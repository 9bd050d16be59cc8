"""Where a robot is that saw nothing for a while, by its own map."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from mrslam.rbpf.front_end.look_around import found_near, look_around, shown_at
from mrslam.spatial import se2
from mrslam.spatial.hits.store import TileStore
from mrslam.spatial.runtime.crew import Crew
from tests.rbpf import rooms
from tests.rbpf.rooms import drawn, seen_room

SIGMA_M = 0.05
"""Of a scan's points."""


def closet() -> NDArray[np.float64]:
    """Points ``(N, 5)`` of a scan in the small room; the niche in one wall tells its ends apart."""
    walls = [
        (np.linspace(-0.9, 1.1, 60), np.full(60, -0.9), (0.0, 1.0)),
        (np.linspace(-0.9, 0.3, 40), np.full(40, 1.0), (0.0, -1.0)),
        (np.linspace(0.3, 1.1, 30), np.full(30, 0.6), (0.0, -1.0)),
        (np.full(60, -0.9), np.linspace(-0.9, 1.0, 60), (1.0, 0.0)),
        (np.full(50, 1.1), np.linspace(-0.9, 0.6, 50), (-1.0, 0.0)),
    ]
    return np.concatenate([np.column_stack([x, y, np.tile([*n, 1.0], (x.size, 1))]) for x, y, n in walls])


def closets(*T_map_base: tuple[float, float, float]) -> TileStore:
    """A map of equal small rooms, each seen from within."""
    return drawn(closet(), *map(np.array, T_map_base))


@pytest.mark.parametrize("leap", [(1.2, 0.9, 0.3), (-2.6, 1.4, -0.6), (0.4, -2.8, 0.6)])
def test_a_place_to_which_no_wheels_lead_is_found_within_three_metres(leap: tuple[float, float, float]) -> None:
    store, points = seen_room()
    looked = look_around(store.tiles(0), points, np.array(leap), SIGMA_M, Crew(1))
    assert looked.place is not None and np.abs(looked.place).max() < 0.03
    assert not (looked.is_contradicted or looked.is_unknown)


def test_of_two_rooms_that_look_alike_neither_is_believed() -> None:
    between = np.array([1.2, 0.3, 0.0])  # where the wheels lead, and nothing fits
    one = look_around(closets((0.0, 0.0, 0.0)).tiles(0), closet(), between, SIGMA_M, Crew(1))
    assert one.place is not None and np.abs(one.place).max() < 0.03
    two = look_around(closets((0.0, 0.0, 0.0), (2.6, 0.0, 0.0)).tiles(0), closet(), between, SIGMA_M, Crew(1))
    assert two.place is None and two.is_contradicted and not two.is_unknown


@pytest.mark.parametrize(
    ("led_to", "moved_share", "is_contradicted"),
    [((0.3, -0.2, -0.42), 0.25, False), ((0.3, -0.2, -0.42), 0.4, True), ((1.0, 0.3, 0.3), 0.25, True)],
    ids=["it fits nearly as usual near by", "it hardly fits", "it fits, but far from where the wheels lead"],
)
def test_wheels_are_contradicted_where_a_scan_does_not_fit_near_where_they_lead(
    led_to: tuple[float, float, float], moved_share: float, is_contradicted: bool
) -> None:
    points = closet()
    points[np.random.default_rng(1).random(len(points)) < moved_share, :2] *= 0.5  # furniture came
    looked = look_around(closets((0.0, 0.0, 0.0)).tiles(0), points, np.array(led_to), SIGMA_M, Crew(1))
    assert looked.place is None and looked.is_contradicted == is_contradicted and not looked.is_unknown


@pytest.mark.parametrize(("usual_fit", "is_contradicted"), [(1.0, True), (0.85, True), (0.7, False), (0.8, True)])
def test_a_map_that_scans_never_fitted_well_contradicts_no_scan_that_fits_as_usual(
    usual_fit: float, is_contradicted: bool
) -> None:
    points = closet()
    points[np.random.default_rng(1).random(len(points)) < 0.4, :2] *= 0.5  # leaves move
    store, at = closets((0.0, 0.0, 0.0)), np.array([0.02, 0.0, 0.0])
    looked = look_around(store.tiles(0), points, at, SIGMA_M, Crew(1), usual_fit)
    assert looked.place is None and looked.is_contradicted == is_contradicted and not looked.is_unknown


def test_where_the_wheels_lead_to_one_of_two_equal_rooms_it_is_that_one() -> None:
    store = closets((0.0, 0.0, 0.0), (2.6, 0.0, 0.0))
    looked = look_around(store.tiles(0), closet(), np.array([2.5, 0.05, 0.02]), SIGMA_M, Crew(1))
    assert looked.place is not None and np.abs(se2.between(np.array([2.6, 0.0, 0.0]), looked.place)).max() < 0.03


@pytest.mark.parametrize(("off_m", "is_there"), [(0.1, True), (0.6, False)])
def test_a_scan_shows_a_robot_where_it_stands_and_not_beside_that(off_m: float, is_there: bool) -> None:
    at = shown_at(closets((0.0, 0.0, 0.0)).tiles(0), closet(), np.array([off_m, 0.0, 0.0]), SIGMA_M)
    assert (at is not None) == is_there
    assert at is None or np.abs(at).max() < 0.03


def test_along_a_bare_corridor_no_scan_shows_where_a_robot_stands() -> None:
    x = np.linspace(-8.0, 8.0, 400)
    sides = [
        np.column_stack([x, np.full_like(x, y), np.tile([0.0, -np.sign(y), 1.0], (x.size, 1))]) for y in (-1.0, 1.0)
    ]
    store = drawn(np.concatenate(sides), np.zeros(3))
    near = np.concatenate([side[150:250] for side in sides])
    looked = look_around(store.tiles(0), near, np.zeros(3), SIGMA_M, Crew(1))
    assert looked.place is not None and shown_at(store.tiles(0), near, np.zeros(3), SIGMA_M) is None


@pytest.mark.parametrize("x_m", [8.0, 2.5], ids=["it shows nothing there", "it shows a little"])
def test_a_place_that_the_map_does_not_show_is_neither_confirmed_nor_contradicted(x_m: float) -> None:
    hall = closet() * [3.0, 3.0, 1.0, 1.0, 1.0]
    looked = look_around(closets((0.0, 0.0, 0.0)).tiles(0), hall, np.array([x_m, 0.0, 0.0]), SIGMA_M, Crew(1))
    assert looked.place is None and looked.is_unknown and not looked.is_contradicted


@pytest.mark.parametrize(
    ("y_m", "is_believed"),
    [(1.8, True), (2.2, False), (-2.2, True)],
    ids=["not far from it", "the map does not show that", "the map contradicts that"],
)
def test_half_a_scan_shows_no_place_far_from_where_the_wheels_lead_unless_the_map_contradicts_them(
    y_m: float, is_believed: bool
) -> None:
    store, points = seen_room()
    points[np.random.default_rng(1).random(len(points)) < 0.45, :2] *= 2.0  # beyond what the map shows
    looked = look_around(store.tiles(0), points, np.array([0.0, y_m, 0.0]), SIGMA_M, Crew(1))
    assert (looked.place is not None) == is_believed and looked.is_unknown != is_believed
    assert not looked.is_contradicted and (looked.place is None or np.abs(looked.place).max() < 0.03)


@pytest.mark.parametrize(("usual_fit", "is_believed"), [(1.0, False), (0.9, True)])
def test_a_place_far_from_where_the_wheels_lead_is_fitted_as_usual_unless_the_map_contradicts_them(
    usual_fit: float, is_believed: bool
) -> None:
    store, points = seen_room()
    points[np.random.default_rng(1).random(len(points)) < 0.1, :2] *= 2.0  # a room like another
    looked = look_around(store.tiles(0), points, np.array([0.0, 2.2, 0.0]), SIGMA_M, Crew(1), usual_fit)
    assert (looked.place is not None) == is_believed and looked.is_unknown != is_believed


def two_rooms() -> NDArray[np.float64]:
    """Walls ``(n, 4)`` of two rooms 3.2 m apart that differ by a box, with a door between them."""
    room = [[0.0, 0.0, 3.0, 0.0], [0.0, 3.0, 3.0, 3.0], *box(0.8, 1.9, 0.4), *box(1.9, 0.5, 0.1)]
    other = [[x0 + 3.2, y0, x1 + 3.2, y1] for x0, y0, x1, y1 in room]
    outer = [[0.0, 0.0, 0.0, 3.0], [6.2, 0.0, 6.2, 3.0], *box(5.4, 2.2, 0.4)]
    between = [[x, y0, x, y1] for x in (3.0, 3.2) for y0, y1 in ((0.0, 0.2), (0.6, 3.0))]
    return np.array([*room, *other, *outer, *between, [3.0, 0.2, 3.2, 0.2], [3.0, 0.6, 3.2, 0.6]])


def box(x: float, y: float, side: float) -> list[list[float]]:
    corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side)]
    return [[*corners[k - 1], *corners[k]] for k in range(4)]


@pytest.mark.parametrize("error_m", [(-0.15, -0.1), (-0.15, 0.1), (-0.1, 0.15)])
def test_in_the_next_room_a_robot_is_not_where_it_was_though_that_looks_alike(
    error_m: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The map shows a little of it through the door; one descent draws the wall between onto its other side."""
    monkeypatch.setattr(rooms, "WALLS", two_rooms())

    def seen(x_m: float, y_m: float) -> NDArray[np.float64]:
        return rooms.seen_from(se2.between(rooms.T_WORLD_START, np.array([x_m, y_m, 0.0])))

    store = drawn(seen(1.5, 1.5), np.array([1.5, 1.5, 0.0]))
    for x_m, y_m in [(0.5, 2.6), (0.5, 0.5)]:
        store.draw(0, np.zeros((1, 2)), np.array([[x_m, y_m, 0.0]]), [seen(x_m, y_m)], 0.1)
    led_to = np.array([4.2 + error_m[0], 0.9 + error_m[1], 0.0])
    looked = look_around(store.tiles(0), seen(4.2, 0.9), led_to, SIGMA_M, Crew(1))
    assert looked.place is None and looked.is_unknown and not looked.is_contradicted


@pytest.mark.parametrize(("beyond_share", "is_found"), [(0.0, True), (0.45, False)])
def test_in_a_saved_map_beams_that_end_in_what_is_unknown_do_not_show_which_of_two_equal_rooms_it_is(
    beyond_share: float, is_found: bool
) -> None:
    store, points = closets((0.0, 0.0, 0.0), (2.6, 0.0, 0.0)), closet()
    points[np.random.default_rng(1).random(len(points)) < beyond_share, :2] *= 8.0
    place = found_near(store.tiles(0), points, np.array([0.05, 0.02, 0.0]), SIGMA_M, Crew(1))
    assert (place is not None) == is_found
    if place is not None:
        assert np.abs(place).max() < 0.03
