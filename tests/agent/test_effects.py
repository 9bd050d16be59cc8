"""What of an alignment job follows from where its maps were told to lie."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from mrslam.agent.effects import AlignJob, joined_fields, known_fields
from mrslam.alignment import Prior
from mrslam.spatial import OccupancyGrid

GRID = OccupancyGrid(np.zeros((2, 2), dtype=np.int8), 0.05)
PRIOR = Prior(np.zeros(3), np.eye(3))
PLACE = np.array([1.0, 2.0, 0.5])


def job(a: str = "r1", b: str = "r2", **more: Any) -> AlignJob:
    given = {"prior": None, "versions": ((1, 1), (1, 1)), "area_m2": (10.0, 70.0), "attempt": 0, **more}
    return AlignJob(a, b, GRID, GRID, **given)


def test_the_saved_map_of_a_pair_is_the_one_that_is_saved() -> None:
    assert job().saved_m2 is None
    assert job("office@monday", "r1").saved_m2 == 10.0 and job("r1", "office@monday").saved_m2 == 70.0
    assert job("office@monday", "office@friday").saved_m2 is None  # no robot is looked for


@pytest.mark.parametrize(
    ("told", "is_told", "follows"),
    [
        ({"prior": PRIOR}, True, False),
        ({}, False, False),
        ({"prior": PRIOR, "sighted": PLACE}, False, False),
        ({"prior": PRIOR, "place": PLACE}, False, True),
        ({"prior": PRIOR, "place": PLACE, "hinted_by": "r3"}, False, False),
        ({"place": PLACE}, False, False),
    ],
    ids=["starts", "nothing", "seen", "found before", "found by another", "found before, searched nowhere else"],
)
def test_where_maps_are_looked_for(told: dict[str, Any], is_told: bool, follows: bool) -> None:
    assert (job(**told).is_told, job(**told).follows) == (is_told, follows)


@pytest.mark.parametrize(
    ("a", "b", "by", "is_vouched"),
    [
        ("office@monday", "r1", "r1", True),
        ("office@monday", "r1", "r3", False),
        ("r1", "r2", "r1", False),
        ("office@monday", "r1", None, False),
    ],
)
def test_a_robot_vouches_for_where_it_is_in_a_saved_map_itself(
    a: str, b: str, by: str | None, is_vouched: bool
) -> None:
    assert job(a, b, hinted_by=by).is_vouched is is_vouched


def test_what_is_known_and_joined_is_told_in_plain_values() -> None:
    assert known_fields(1.234, 5.678, {"r2", "r1"}) == {"own_m2": 1.23, "team_m2": 5.68, "placed": ["r1", "r2"]}
    ties = [("r1", "r2", True), ("r1", "r2", True), ("r2", "r3", True), ("r1", "r3", False)]
    bent: Any = type("Bent", (), {})()
    bent.ties = [type("Tie", (), {"a": a, "b": b, "believed": believed})() for a, b, believed in ties]
    bent.bends = {"r2": type("Bend", (), {"most_m": 0.12345})()}
    bent.ambiguous = {("r1", "r3"): "two places"}
    assert joined_fields(bent) == {
        "ties": {"r1-r2": 2, "r2-r3": 1},
        "dropped": 1,
        "bent_m": {"r2": 0.123},
        "ambiguous": {"r1-r3": "two places"},
    }
