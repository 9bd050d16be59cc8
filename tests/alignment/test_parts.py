"""Large maps bent by metres fit in parts: where those lie to each other as in their map, the whole may bend."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mrslam.alignment import Alignment, AlignmentConfig, Evidence, Prior, Rejection, align
from mrslam.alignment.parts import LARGE_M, MOST_PARTS, PART_M, Part, agree, found_parts, in_parts, is_large, parts_of
from mrslam.alignment.prepared import PreparedMap, prepare
from mrslam.alignment.verification.bend import Bend
from mrslam.sim_driver.worlds.office import office
from mrslam.spatial import OccupancyGrid, se2

RES = 0.1
CELLS = np.array([-1, 0, 100], dtype=np.int8)
"""By state of a prepared map."""
FIRM = AlignmentConfig(strain=0.0)
NOWHERE = Rejection("too little wall in common", 0.1, None, "auto")


@pytest.fixture(scope="module")
def floor() -> PreparedMap:
    """Return an office of 220 m."""
    return prepare(office(3, 220.0), RES)


def bow(side: PreparedMap, deep_m: float) -> Bend:
    """Return a bend to a bow, as a heading that drifts evenly makes it; ``deep_m`` : from its middle to its ends."""
    (x0, y0), (x1, y1) = side.points.min(axis=0), side.points.max(axis=0)
    xs = np.meshgrid(np.arange(x0, x1 + 4.0, 4.0), np.arange(y0, y1 + 4.0, 4.0))[0]
    shift = deep_m * ((xs - 0.5 * (x0 + x1)) / (0.5 * (x1 - x0))) ** 2
    return Bend(se2.IDENTITY, np.stack([np.zeros_like(xs), shift], axis=-1), float(x0), float(y0), 4.0, 0.0)


def grid(side: PreparedMap) -> OccupancyGrid:
    return OccupancyGrid(CELLS[side.state], side.res, (side.x0, side.y0))


def test_a_large_map_that_is_bent_by_metres_may_bend_where_its_parts_lie(floor: PreparedMap) -> None:
    by = bow(floor, 3.0)
    outcome = align(grid(floor), grid(by.bent(floor)), config=FIRM)
    assert isinstance(outcome, Rejection) and outcome.T_a_b is not None
    assert (
        outcome.is_in_parts
        and outcome.may_bend
        and outcome.reason.endswith("; parts of 50 m fit one by one: the whole is bent too much")
    )
    assert outcome.evidence is not None and outcome.evidence.matched_m > 50.0
    # It lies right somewhere along the bow.
    at = floor.points[:: len(floor.points) // 500]
    off = np.hypot(*(se2.apply(outcome.T_a_b, by.forward(at)) - at).T)
    assert off.min() < 0.1 and np.median(off) > 0.3


def test_what_fits_as_a_whole_and_what_is_small_is_not_looked_at_in_parts(floor: PreparedMap) -> None:
    assert isinstance(align(grid(floor), grid(floor), config=FIRM), Alignment)
    small = prepare(office(3, 80.0), RES)
    assert is_large(floor) and not is_large(small)
    outcome = align(grid(small), grid(bow(small, 3.0).bent(small)), config=FIRM)
    assert isinstance(outcome, Rejection) and not outcome.is_in_parts
    outcome = align(grid(floor), grid(bow(floor, 3.0).bent(floor)), config=FIRM, by_parts=False)
    assert isinstance(outcome, Rejection) and not outcome.is_in_parts  # nor where nobody asked


def test_another_building_fits_in_no_two_parts(floor: PreparedMap) -> None:
    outcome = align(grid(floor), grid(prepare(office(8, 200.0), RES)), config=FIRM)
    assert isinstance(outcome, Rejection) and not outcome.is_in_parts


def test_only_near_a_place_that_was_asked_about(floor: PreparedMap) -> None:
    a, b = grid(floor), grid(bow(floor, 3.0).bent(floor))
    found = align(a, b, config=FIRM).T_a_b
    assert found is not None
    beside = found + np.array([5.0, 0.0, 0.0])
    for place, is_there in ((found, True), (beside, False)):
        for prior in (None, Prior(place, np.diag([0.25, 0.25, 0.01]))):
            outcome = align(a, b, config=FIRM, place=place, prior=prior)
            assert isinstance(outcome, Rejection) and outcome.is_in_parts == is_there
    # A prior alone says where the whole lies.
    outcome = align(a, b, config=FIRM, prior=Prior(found, np.diag([0.25, 0.25, 0.01])))
    assert isinstance(outcome, Rejection) and not outcome.is_in_parts


def test_a_map_is_cut_evenly_into_parts_that_hold_all_of_it(floor: PreparedMap) -> None:
    parts = parts_of(floor)
    assert len(parts) == 4
    walls = [part.wall_m for part in parts]
    assert walls == sorted(walls, reverse=True)
    assert sum(walls) == pytest.approx(floor.wall_m, rel=0.05)
    cells = {tuple(np.round(point, 3)) for point in floor.points}
    for part in parts:
        assert np.max(np.ptp(part.points, axis=0)) < 1.25 * PART_M
        inside = [tuple(point) in cells for point in np.round(part.points, 3)]
        assert np.mean(inside) > 0.95  # but for ends where it was cut


def at(x: float, T: tuple[float, float, float], wall_m: float = 50.0) -> Part:
    evidence = replace(Evidence(), a=replace(Evidence().a, matched_m=wall_m), b=replace(Evidence().b, matched_m=wall_m))
    return Part(np.array([x, 0.0]), Alignment(np.array(T), 0.9, evidence, np.eye(3), "auto"))


@pytest.mark.parametrize(
    ("other", "is_one"),
    [
        (at(100.0, (0.0, 0.0, 0.0)), True),
        (at(100.0, (3.4, 0.0, 0.0)), True),  # 0.5 m and 3 % of 100 m
        (at(100.0, (3.6, 0.0, 0.0)), False),
        (at(100.0, (0.0, -3.6, 0.0)), False),
        (at(100.0, (0.0, 0.0, 0.06)), True),  # 3 m at the middle between them
        (at(100.0, (0.0, 0.0, 0.08)), False),
        (at(10.0, (0.0, 0.0, 0.09)), True),
        (at(10.0, (0.0, 0.0, -0.11)), False),
        (at(10.0, (0.0, 0.0, 2.0 * math.pi + 0.05)), True),
    ],
)
def test_parts_agree_within_usual_bending(other: Part, is_one: bool) -> None:
    one = at(0.0, (0.0, 0.0, 0.0))
    assert agree(one, other) == agree(other, one) == is_one


def test_one_part_alone_or_two_that_lie_apart_say_nothing(floor: PreparedMap) -> None:
    asked: list[PreparedMap] = []

    def found_at(*places: float | None) -> list[Part]:
        asked.clear()
        said = iter(places)

        def find(part: PreparedMap) -> Alignment | Rejection:
            asked.append(part)
            x = next(said)
            return NOWHERE if x is None else at(0.0, (x, 0.0, 0.0), wall_m=10.0 * len(asked)).found

        return found_parts(floor, find)

    assert found_at(0.0, None, None, None) == [] and len(asked) == 4
    assert found_at(0.0, 40.0, 80.0, 120.0) == []
    parts = found_at(0.0, 40.0, None, 0.2)
    assert [part.found.T_a_b[0] for part in parts] == [0.2, 0.0]  # more wall agrees first
    assert found_at(0.0, 0.2) and len(asked) == 2  # two are enough


def test_the_parts_with_most_wall_are_looked_for_and_not_all() -> None:
    cells = np.zeros((4000, 4000), dtype=np.int8)
    for k in range(0, 4000, 250):
        cells[k : k + 2, : 4000 - k] = 100
    side = prepare(OccupancyGrid(cells, RES), RES)
    asked: list[float] = []

    def find(part: PreparedMap) -> Rejection:
        asked.append(part.wall_m)
        return NOWHERE

    assert len(parts_of(side)) > MOST_PARTS
    assert in_parts(side, NOWHERE, find) is NOWHERE
    assert asked == [part.wall_m for part in parts_of(side)[:MOST_PARTS]]


def test_parts_with_hardly_any_wall_are_left_out() -> None:
    cells = np.zeros((300, 1200), dtype=np.int8)
    cells[100, :550] = cells[50:250, 20] = 100
    cells[100, 900:990] = 100  # 9 m, either side of which counts
    cells[100, 1190:] = 100
    side = prepare(OccupancyGrid(cells, RES), RES)
    assert is_large(side) and np.max(np.ptp(side.points, axis=0)) > LARGE_M
    assert [round(part.wall_m) > 100 for part in parts_of(side)] == [True]
