"""Office floors: corridors and the passages between them, rooms that are reached, and furniture that can be passed."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from mrslam.sim_driver.worlds.canvas import Canvas
from mrslam.sim_driver.worlds.office import _crossing, _furnish, _Room, _row, office

SEEDS = range(16)
TWO_M = 15.0
"""A floor of two corridors is deeper than this, one of a single corridor is not, metres."""


def floor(seed: int) -> NDArray[np.bool_]:
    return office(seed).cells == 0


def depth_m(seed: int) -> float:
    return office(seed).shape[0] * office(seed).resolution_m


def test_floors_have_one_corridor_or_two_and_the_width_that_was_asked_for() -> None:
    depths = np.array([depth_m(seed) for seed in SEEDS])
    assert (depths < 12.5).any() and (depths > 16.0).any() and not ((depths > 12.5) & (depths < 16.0)).any()
    assert np.mean(depths > TWO_M) > 0.5
    grid = office(3, 24.0)
    assert grid.shape[1] * grid.resolution_m == pytest.approx(24.0, abs=0.15)


def gaps_of_back_wall(is_floor: NDArray[np.bool_]) -> list[float]:
    """Return how wide the gaps in the wall between the rooms of two corridors are, metres."""
    third = is_floor.shape[0] // 3
    row = third + int(np.argmin(is_floor[third : 2 * third].sum(axis=1)))
    labels, count = ndimage.label(is_floor[row])
    return [0.05 * float(size) for size in np.bincount(labels, minlength=count + 1)[1:]]


def test_two_corridors_are_joined_by_two_passages_and_nothing_else() -> None:
    seeds = [seed for seed in SEEDS if depth_m(seed) > TWO_M]
    for seed in seeds:
        gaps_m = gaps_of_back_wall(floor(seed))
        assert len(gaps_m) == 2 and all(1.4 < gap_m < 2.5 for gap_m in gaps_m), (seed, gaps_m)


def test_nearly_all_of_a_floor_is_rooms_and_corridors_and_most_rooms_are_furnished() -> None:
    pieces = 0
    for seed in SEEDS:
        is_floor = floor(seed)
        assert is_floor.mean() > 0.78, seed
        pieces += ndimage.label(~is_floor)[1]
    assert pieces > 10 * len(SEEDS)  # beside walls, what stands free in rooms


def test_rooms_side_by_side_fill_a_strip_each_with_a_door_to_the_corridor_and_some_to_a_neighbour() -> None:
    passages = 0
    for seed in range(20):
        plan, doors = Canvas(25.0, 4.0), []
        rooms = _row(plan, np.random.default_rng(seed), 0.0, 4.0, 4.0, 25.0, doors)
        assert rooms[0].x0 == 0.0 and rooms[-1].x1 == 25.0
        assert all(left.x1 == right.x0 for left, right in pairwise(rooms))
        assert min(room.x1 - room.x0 for room in rooms) >= 2.6
        to_corridor = [x for x, y in doors if y == 4.0]
        assert len(to_corridor) == len(rooms)
        for room, x in zip(rooms, to_corridor, strict=True):
            assert room.x0 + 0.7 < x < room.x1 - 0.7
        passages += sum(y == 2.0 for _, y in doors)
    assert 5 < passages < 60


def test_a_passage_has_walls_of_its_own_and_what_it_leaves_of_a_room_opens_to_it() -> None:
    plan = Canvas(20.0, 12.0)
    cut, whole = _Room(4.0, 2.0, 12.0, 6.0), _Room(12.0, 2.0, 18.0, 6.0)
    below = _Room(4.0, 0.0, 12.0, 2.0)
    assert _crossing(plan, [cut, whole, below], 7.0, 9.0, 2.0, 6.0) == [whole, below]
    is_floor = plan.cells == 0
    for x in (7.0, 9.0):
        wall = is_floor[round(2.2 / 0.05) : round(5.8 / 0.05), round(x / 0.05)]
        assert np.count_nonzero(wall) * 0.05 == pytest.approx(1.0, abs=0.1)  # the door in it
    assert is_floor[round(2.2 / 0.05) : round(5.8 / 0.05), round(7.2 / 0.05) : round(8.8 / 0.05)].all()


def test_furniture_stands_clear_of_doors_and_of_each_other_and_leaves_no_gap_to_be_stuck_in() -> None:
    room, door, stood = _Room(0.0, 0.0, 6.0, 5.0), (3.0, 0.0), 0
    for seed in range(30):
        plan = Canvas(6.0, 5.0)
        _furnish(plan, np.random.default_rng(seed), room, [door])
        labels, count = ndimage.label(plan.cells[2:-2, 2:-2])
        stood += count
        for rows, cols in ndimage.find_objects(labels):
            low = np.array([cols.start, rows.start]) * 0.05 + 0.1
            high = np.array([cols.stop, rows.stop]) * 0.05 + 0.1
            near = np.clip(door, low, high)
            assert np.hypot(*(near - np.array(door))) > 0.7
            for gap_m in (*low, 6.0 - high[0], 5.0 - high[1]):
                assert gap_m < 0.2 or gap_m > 0.75
    assert stood > 40
