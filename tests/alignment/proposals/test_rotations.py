"""The turns that lay walls' directions on each other."""

from __future__ import annotations

import math

import numpy as np

from mrslam.alignment.prepared import prepare
from mrslam.alignment.proposals.rotations import rotations
from mrslam.spatial import OccupancyGrid, se2
from tests.alignment.conftest import House


def test_the_turn_between_two_maps_is_found_to_half_a_degree_and_so_is_half_a_turn_more(house: House) -> None:
    whole = slice(0, 400), slice(0, 520)
    a = prepare(house.part(*whole, np.zeros(3)), 0.05)
    for turn_deg in (33.25, -120.75):
        b = prepare(house.part(*whole, se2.transform(1.0, 2.0, math.radians(-turn_deg))), 0.05)
        found = rotations(a, b, 6, 0.0)
        off_deg = [abs(math.degrees(math.remainder(turn - math.radians(turn_deg), 2 * math.pi))) for turn, _ in found]
        assert min(off_deg) < 0.5
        turns, strengths = np.array(found).T
        np.testing.assert_allclose(turns[1::2] - turns[::2], math.pi)
        assert strengths[0] == 1.0 and (np.diff(strengths) <= 0.0).all()


def test_turns_are_apart_and_as_many_and_as_likely_as_asked_for(house: House) -> None:
    part = prepare(house.part(slice(0, 400), slice(0, 330), np.zeros(3)), 0.05)
    every, likely, two = (rotations(part, part, *asked) for asked in ((40, 0.0), (40, 0.5), (2, 0.0)))
    assert two == every[:4] and likely == [one for one in every if one[1] >= 0.5] and len(likely) < len(every)
    turns = np.array([turn for turn, _ in every[::2]])
    apart = np.abs([math.remainder(one - other, math.pi) for k, one in enumerate(turns) for other in turns[:k]])
    assert math.degrees(apart.min()) > 2.0


def test_walls_without_a_direction_are_turned_without_a_division_by_nothing() -> None:
    cells = np.zeros((1, 60), np.int8)
    cells[0, ::6] = 100
    dots = prepare(OccupancyGrid(cells, 0.05), 0.05)
    with np.errstate(all="raise"):
        found = rotations(dots, dots, 3)
    assert np.isfinite(np.array(found)).all()
