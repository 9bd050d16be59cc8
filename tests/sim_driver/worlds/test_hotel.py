"""Hotels: rooms that are equal to the cell, wings that do not cut each other, and what stands in one of them only."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import ndimage

from mrslam.sim_driver.worlds.hotel import (
    BED_M,
    DESK_M,
    DOOR_M,
    RESOLUTION_M,
    ROOMS,
    SINGLE_M,
    WALL_M,
    _draw_wing,
    _single,
    _star,
    _Wing,
    _wing_cells,
    hotel,
)

SEEDS = range(12)
ROBOT_M = 0.25
"""Half a robot's width, and what it keeps to walls, metres."""


def wing_of(seed: int) -> tuple[_Wing, NDArray[np.int8]]:
    wing = _draw_wing(np.random.default_rng(seed))
    return wing, _wing_cells(wing)


def cells_of(length_m: float) -> int:
    return round(length_m / RESOLUTION_M)


@pytest.mark.parametrize("seed", SEEDS)
def test_rooms_of_a_wing_are_equal_to_the_cell_on_both_sides_of_its_corridor(seed: int) -> None:
    wing, cells = wing_of(seed)
    width, wall = cells_of(wing.width_m), cells_of(WALL_M)
    np.testing.assert_array_equal(cells, cells[::-1])
    depth = cells_of(wing.depth_m)
    rooms = [cells[: depth - 2, wall + i * width : (i + 1) * width] for i in range(wing.rooms)]
    for room in rooms:
        np.testing.assert_array_equal(room, rooms[0])
    for i in range(1, wing.rooms):
        assert (cells[: depth - 2, i * width : i * width + wall] == 100).all()  # no room opens to its neighbour


@pytest.mark.parametrize("seed", SEEDS)
def test_every_room_has_a_door_to_the_corridor_a_bed_and_a_desk(seed: int) -> None:
    wing, cells = wing_of(seed)
    depth, width, wall = cells_of(wing.depth_m), cells_of(wing.width_m), cells_of(WALL_M)
    for i in range(wing.rooms):
        room = slice(wall + i * width, (i + 1) * width)
        assert np.count_nonzero(cells[depth, room] == 0) == pytest.approx(cells_of(DOOR_M), abs=1)
        furniture = np.count_nonzero(cells[wall : depth - wall, room]) * RESOLUTION_M**2
        assert furniture == pytest.approx(math.prod(BED_M) + math.prod(DESK_M), rel=0.08)
    corridor = cells[depth + wall : depth + cells_of(wing.corridor_m) - wall, : wing.rooms * width]
    assert not corridor.any()


def test_wings_have_every_number_of_rooms() -> None:
    assert {wing_of(seed)[0].rooms for seed in range(40)} == set(range(*ROOMS))


def marked(count: int) -> tuple[_Wing, NDArray[np.int8], int]:
    """Return wings of one mark each around a hall, and how many cells of each its corridor's mouth leaves."""
    wing, cells = wing_of(3)
    plan = _star([np.full(cells.shape, 10 + k, dtype=np.int8) for k in range(count)], wing)
    return wing, plan, cells.size - 2 * cells_of(wing.corridor_m - WALL_M)


@pytest.mark.parametrize("count", [2, 3, 4])
def test_wings_around_a_hall_are_whole_and_turned_by_equal_angles(count: int) -> None:
    _, plan, left = marked(count)
    middle = (np.array(plan.shape) - 1) / 2
    angles = []
    for k in range(count):
        row, col = np.nonzero(plan == 10 + k)
        assert row.size == pytest.approx(left, rel=0.005)
        angles.append(math.atan2(row.mean() - middle[0], col.mean() - middle[1]))
    turns = np.diff(angles) % (2.0 * math.pi)
    np.testing.assert_allclose(turns, 2.0 * math.pi / count, atol=0.01)
    assert plan[round(middle[0]), round(middle[1])] == 0


def strips_of(seed: int) -> list[NDArray[np.int8]] | None:
    """Return the wings of a hotel that is a comb, without the cross corridor; None of one that is a star."""
    cells = hotel(seed).cells
    is_cross = (cells == 0).mean(axis=0) > 0.9
    if not is_cross[2:30].all():
        return None
    inner = cells[:, 2 + int(np.argmin(is_cross[2:])) :]  # a column through doors has as much floor
    for count in (2, 3):
        if inner.shape[0] % count == 0:
            strips = np.split(inner, count)
            if all(np.mean(strip != strips[0]) < 0.02 for strip in strips):
                return strips
    raise AssertionError(f"hotel:{seed} has a cross corridor, and no equal wings at it")


def test_hotels_are_stars_and_combs_some_with_wings_that_can_be_told_apart() -> None:
    combs = [strips for seed in range(40) if (strips := strips_of(seed)) is not None]
    assert len(combs) == 15 and {len(strips) for strips in combs} == {2, 3}
    unlike = [any((strip != strips[0]).any() for strip in strips) for strips in combs]
    assert any(unlike) and not all(unlike)


def single_of(seed: int) -> tuple[_Wing, NDArray[np.int8], NDArray[np.bool_]]:
    """Return a wing's cells, and which of them a thing that stands there only takes."""
    wing, cells = wing_of(seed)
    alone = np.zeros_like(cells)
    _single(alone, wing, np.random.default_rng(seed))
    return wing, cells, alone > 0


@pytest.mark.parametrize("seed", range(20))
def test_what_stands_in_one_place_only_leaves_walls_and_the_way_along_the_corridor_as_they_are(seed: int) -> None:
    wing, cells, single = single_of(seed)
    row, col = np.nonzero(single)
    size = (np.ptp(row) + 1, np.ptp(col) + 1)
    low, high = wing.depth_m / RESOLUTION_M, (wing.depth_m + wing.corridor_m) / RESOLUTION_M
    is_in_corridor = low <= row.min() and row.max() < high
    assert is_in_corridor or row.max() < low or row.min() >= high
    long, wide = cells_of(SINGLE_M[0]), cells_of(SINGLE_M[1])
    assert size == ((wide, long) if is_in_corridor else (long, wide)) and row.size == long * wide
    if is_in_corridor:
        assert min(row.min() - low, high - 1 - row.max()) <= 2  # at a wall
        left = np.count_nonzero(((cells == 0) & ~single)[round(low) : round(high), col[0]])
        assert left * RESOLUTION_M > 1.1


@pytest.mark.parametrize("seed", range(60))
def test_what_stands_in_one_place_only_stands_on_floor_and_closes_no_room(seed: int) -> None:
    wing, cells, single = single_of(seed)
    assert not cells[single].any()
    depth = cells_of(wing.depth_m)
    for i in range(wing.rooms):
        middle = cells_of(WALL_M / 2 + i * wing.width_m + wing.door_m)
        beside = slice(middle - cells_of(DOOR_M / 2 + 0.25), middle + cells_of(DOOR_M / 2 + 0.25))
        for before in (slice(depth + 2, depth + 12), slice(-depth - 12, -depth - 2)):
            assert not single[before, beside].any()
    clear = ndimage.distance_transform_edt((cells == 0) & ~single) * RESOLUTION_M
    labels, _ = ndimage.label(clear > ROBOT_M)
    reached = {labels[row, cells_of(WALL_M / 2 + i * wing.width_m + wing.door_m)]
               for i in range(wing.rooms) for row in (depth - 16, depth + 16, -depth + 16)}  # fmt: skip
    assert len(reached) == 1 and 0 not in reached


def test_a_hotel_is_as_large_as_its_rooms() -> None:
    for seed in range(40):
        grid = hotel(seed)
        assert grid.resolution_m == RESOLUTION_M
        height_m, width_m = (RESOLUTION_M * n for n in grid.shape)
        assert 7.0 < width_m < 45.0 and 7.0 < height_m < 45.0
