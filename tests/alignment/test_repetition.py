"""A map whose outline is open, and whose parts look alike, may have look-alikes beyond it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.alignment import look_alikes
from mrslam.alignment.prepared import prepare
from mrslam.alignment.repetition import open_m, repeated_m
from mrslam.spatial import OccupancyGrid

Room = tuple[int, int]
"""Width, and side of the box in its corner, cells."""
EQUAL: list[Room] = [(80, 14)] * 4
DIFFERENT: list[Room] = [(50, 6), (110, 30), (64, 14), (96, 22)]
HEIGHT = 80
"""Of rooms, cells: 4 m."""


def rooms(plan: list[Room], *, beyond: int = 0) -> OccupancyGrid:
    """Return rooms in a row with a door from each to the next.

    ``beyond`` : cells of the last wall that are missing, with nothing known behind.
    """
    width = sum(one[0] for one in plan) + 1
    cells = np.full((HEIGHT + 7, width + 6), -1, dtype=np.int8)
    floor = cells[3 : HEIGHT + 4, 3 : width + 3]
    floor[:] = 0
    floor[[0, -1]] = 100
    x = 0
    for wide, side in plan:
        floor[:, x] = 100
        if x:
            floor[30:50, x] = 0
        floor[1 : side + 1, x + 6 : x + 6 + side] = 100
        x += wide
    floor[:, -1] = 100
    floor[10 : 10 + beyond, -1] = -1
    return OccupancyGrid(cells, 0.05)


@pytest.mark.parametrize(("beyond", "edge_m"), [(0, 0.0), (7, 0.0), (40, 2.0)])
def test_known_floor_that_ends_at_nothing_known_is_an_edge_where_a_robot_fits_through(
    beyond: int, edge_m: float
) -> None:
    known = prepare(rooms([(80, 14)], beyond=beyond), 0.05)
    assert open_m(known) == pytest.approx(edge_m, abs=0.11)


def test_a_building_that_is_shown_as_a_whole_has_no_look_alikes_elsewhere_though_it_repeats_itself() -> None:
    whole = rooms(EQUAL)
    assert repeated_m(prepare(whole, 0.05)) > 20.0
    assert look_alikes(whole, 0.1) == 0.0


def test_equal_rooms_are_found_to_repeat_and_different_ones_not() -> None:
    equal, different = (prepare(rooms(sides), 0.05) for sides in (EQUAL, DIFFERENT))
    assert repeated_m(equal) > 3.0 * repeated_m(different)


def test_rooms_that_repeat_by_a_shift_alone_and_a_hall_that_does_by_a_turn_alone_both_look_like_another_part() -> None:
    cells = rooms([(80, 14)] * 3).cells.copy()
    for x in (3, 83, 163):  # a corner in every room, so that no turn lays one on another
        cells[63, x + 30 : x + 60] = cells[53:63, x + 30] = 100
    row = prepare(OccupancyGrid(cells, 0.05), 0.05)
    assert 0.5 * row.wall_m < repeated_m(row) < 0.75 * row.wall_m  # two rooms of three lie on rooms
    cells = np.full((86, 126), -1, dtype=np.int8)
    hall = cells[3:83, 3:123]
    hall[:] = 0
    hall[[0, -1]] = hall[:, [0, -1]] = hall[20:26, 20:40] = hall[54:60, 80:100] = 100
    turned = prepare(OccupancyGrid(cells, 0.05), 0.05)
    assert repeated_m(turned) > 0.9 * turned.wall_m


def test_the_more_of_a_building_is_open_the_more_look_alikes_there_are_beyond() -> None:
    one_room, less = rooms([(80, 14)], beyond=60), rooms([(80, 14)], beyond=20)
    assert look_alikes(one_room, 0.1) > look_alikes(less, 0.1) > 0.0
    assert look_alikes(rooms(DIFFERENT, beyond=60), 0.02) < 0.2 * look_alikes(one_room, 0.02)  # of more walls and rooms


def test_where_rooms_are_equal_there_are_as_many_as_of_the_walls_repeat_and_else_one_in_the_rooms_shown() -> None:
    for plan, repeats in ((EQUAL, True), (DIFFERENT, False)):
        known = prepare(grid := rooms(plan, beyond=60), 0.05)
        share = repeated_m(known) / known.wall_m if repeats else 15.0 / known.known_m2
        assert look_alikes(grid, 0.02) == pytest.approx(open_m(known) / known.wall_m * share)


def test_where_a_map_is_hardly_open_or_small_enough_anyway_nothing_is_searched(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("mrslam.alignment.repetition.repeated_m", lambda known: pytest.fail("searched"))
    assert look_alikes(rooms(EQUAL, beyond=30), 0.5) < 0.5
    assert look_alikes(rooms([(80, 14)], beyond=70), 0.01) > 0.01


def test_a_map_without_walls_says_nothing_of_a_building() -> None:
    free = OccupancyGrid(np.zeros((40, 40), dtype=np.int8), 0.05)
    assert look_alikes(free, 0.1) == math.inf
