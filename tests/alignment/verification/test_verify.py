"""What speaks for and against a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.alignment import AlignmentConfig, Evidence, WallEvidence
from mrslam.alignment.prepared import prepare
from mrslam.alignment.verification.fits import rivalry
from mrslam.alignment.verification.reasons import tests as asked_of
from mrslam.alignment.verification.refine import refine
from mrslam.alignment.verification.verify import Case, case, examine, quick_case, settled_cases
from mrslam.spatial import OccupancyGrid, se2

GOOD = Case(matched_m=30.0, opposed_m=0.0, contradicted_m=1.0, free_m2=60.0)


def room(rows: int, cols: int) -> OccupancyGrid:
    """A closed room of free cells with walls four cells thick."""
    cells = np.zeros((rows, cols), dtype=np.int8)
    cells[:4], cells[-4:], cells[:, :4], cells[:, -4:] = 100, 100, 100, 100
    return OccupancyGrid(cells, 0.05, (0.0, 0.0))


def test_maps_that_only_touch_share_no_room_and_are_worth_nothing():
    hall = np.full((200, 80), -1, dtype=np.int8)
    hall[:, :4], hall[:, 4:] = 100, 0
    strip = np.full((200, 8), -1, dtype=np.int8)
    strip[:, :4], strip[:, 4:7] = 100, 0
    a = prepare(OccupancyGrid(hall, 0.05, (0.0, 0.0)), 0.05)
    for other, worth in ((strip, 0.0), (hall, 9.0)):
        b = prepare(OccupancyGrid(other, 0.05, (0.0, 0.0)), 0.05)
        judged = case(examine(a, b, se2.IDENTITY, 0.15).evidence)
        assert judged.matched_m > 8.0 and judged.contradicted_m == 0.0
        assert judged.worth() >= worth and (judged.worth() < 1.0) == (worth == 0.0)


def test_the_quick_look_says_what_the_long_one_says():
    a, b = prepare(room(160, 240), 0.05), prepare(room(160, 200), 0.05)
    long, quick = case(examine(a, b, se2.IDENTITY, 0.15).evidence), quick_case(a, b, se2.IDENTITY, 0.15)
    assert long.matched_m > 20.0 and long.contradicted_m > 5.0 and long.free_m2 > 50.0
    assert (quick.matched_m, quick.contradicted_m) == (long.matched_m, long.contradicted_m)
    assert quick.free_m2 == pytest.approx(long.free_m2, rel=0.1)
    thinned = quick_case(a, b, se2.IDENTITY, 0.15, 200)
    assert thinned.matched_m == pytest.approx(long.matched_m, rel=0.4)


def test_many_places_settled_in_one_call_are_what_they_are_one_by_one(sides, pair):
    a, b = sides
    schedule = ((0.6, 0.25, 3), (0.4, 0.12, 3))
    places = pair[2] + np.array([[0.1, -0.2, 0.01], [0.0, 0.3, -0.02], [2.0, 1.0, 0.0], [40.0, 0.0, 0.0]])
    one_by_one = [refine(a, b, place, schedule, 300) for place in places]
    cases = settled_cases(a, b, places, schedule, 300, 0.2)
    np.testing.assert_allclose(places, one_by_one, rtol=0, atol=1e-9)
    assert cases == [quick_case(a, b, place, 0.2, 300) for place in one_by_one]
    assert cases[0].matched_m > 3 * cases[2].matched_m and cases[3].matched_m == 0.0


def test_worth_falls_with_contradiction_and_rises_with_wall():
    assert GOOD.worth() > replace(GOOD, contradicted_m=3.0).worth() > replace(GOOD, contradicted_m=9.0).worth() > 0
    assert replace(GOOD, matched_m=40.0, free_m2=80.0).worth() > GOOD.worth()
    assert replace(GOOD, opposed_m=10.0).worth() > GOOD.worth()
    assert replace(GOOD, opposed_m=1000.0).worth() < 2.0 * GOOD.worth()  # walls from behind never carry a fit alone


def test_a_rival_that_contradicts_more_than_it_agrees_is_none():
    much_and_dirty = Case(matched_m=80.0, opposed_m=0.0, contradicted_m=40.0, free_m2=160.0)
    assert much_and_dirty.worth() > 0.3 * GOOD.worth()
    assert rivalry(GOOD, much_and_dirty) == 0.0
    assert rivalry(GOOD, GOOD) == pytest.approx(1.0)
    assert 0.5 < rivalry(GOOD, replace(GOOD, contradicted_m=2.0)) < 1.0


@pytest.mark.parametrize(("matched_m", "passes"), [(9.0, False), (30.0, True)])
def test_a_small_fit_must_be_cleaner_than_a_large_one(matched_m, passes):
    bad = 0.2 * matched_m
    walls = WallEvidence(matched_m=matched_m, contradicted_m=bad)
    evidence = Evidence(a=walls, b=walls, crosswise_m=3.0, walls=6, score_m=9.0, margin=1.0)
    assert all(test.slack >= 0 for test in asked_of(evidence, AlignmentConfig())) == passes


@pytest.mark.parametrize("beside", [0, 1])
def test_a_map_overlaps_another_by_no_more_than_all_of_it(beside: int) -> None:
    cells = np.full((70, 70), -1, dtype=np.int8)
    cells[beside : beside + 61, beside : beside + 61] = room(61, 61).cells  # odd: every second cell is looked at
    a = prepare(OccupancyGrid(cells, 0.05, (0.0, 0.0)), 0.05)
    assert 0.9 < examine(a, a, se2.IDENTITY, 0.15).evidence.overlap <= 1.0


def test_what_lies_deep_in_the_free_space_of_the_other_map_is_told_of_each_map() -> None:
    empty, furnished = room(160, 240), room(160, 240)
    furnished.cells[70:90, 100:130] = 100
    a, b = prepare(empty, 0.05), prepare(furnished, 0.05)
    for one, two, with_table, without in ((a, b, "b", "a"), (b, a, "a", "b")):
        found = examine(one, two, se2.IDENTITY, 0.15).evidence
        assert 3.0 < getattr(found, with_table).deep_m <= getattr(found, with_table).contradicted_m
        assert getattr(found, without).deep_m == 0.0


def test_the_walls_that_hold_a_fit_are_measured_across_and_about_their_middle() -> None:
    side = prepare(room(160, 240), 0.05)  # 8 x 12 m
    found = examine(side, side, se2.IDENTITY, 0.15)
    assert found.evidence.crosswise_m == pytest.approx(2 * 7.6, rel=0.05)  # its shorter walls
    assert found.evidence.residual == pytest.approx(0.0, abs=1e-6) and found.evidence.walls == 4
    assert found.evidence.extent_m == pytest.approx(float(np.sqrt(side.points.var(axis=0).sum())), rel=1e-6)
    assert found.pivot == pytest.approx(side.centre)
    off = examine(side, side, np.array([0.1, 0.1, 0.0]), 0.15).evidence
    assert 0.3 < off.residual < 0.8


def test_another_side_of_a_wall_counts_as_one_of_the_walls_that_agree() -> None:
    """Two rooms on either side of a thin wall, seen from one each: it is all that they share."""
    cells = np.full((120, 200), -1, dtype=np.int8)
    cells[10:110, 100:102] = 100
    left, right = cells.copy(), cells.copy()
    left[10:110, 20:100], right[10:110, 102:180] = 0, 0
    a, b = (prepare(OccupancyGrid(one, 0.05), 0.05) for one in (left, right))
    found = examine(a, b, se2.IDENTITY, 0.15).evidence
    assert found.a.opposed_m > 4.0 and found.a.matched_m == 0.0 and found.walls == 1
