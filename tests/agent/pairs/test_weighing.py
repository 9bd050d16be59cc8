"""What walls must say of a place before encounters may decide about it."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.pairs.hypotheses import Hypotheses, Hypothesis
from mrslam.agent.pairs.weighing import FITTED_M, agrees, by_sight, is_worth_keeping, weighed
from mrslam.alignment import Alignment, Evidence, Rejection, WallEvidence
from mrslam.mutual_detection import MutualFix, Sightings
from mrslam.mutual_detection.encounters import MOST_HIDDEN_LLR
from mrslam.spatial import se2

HERE = se2.transform(2.0, -1.0, 0.4)
THERE = se2.transform(-4.0, 3.0, 0.4)


def walls(matched_m: float, a_against_m: float, b_against_m: float) -> Evidence:
    """Walls of two maps that agree, and walls of either that lie on the other's floor, metres."""
    return Evidence(
        a=WallEvidence(matched_m=matched_m, contradicted_m=a_against_m),
        b=WallEvidence(matched_m=matched_m, contradicted_m=b_against_m),
    )


@pytest.mark.parametrize(
    ("matched_m", "a_against_m", "b_against_m", "is_fine"),
    [
        (1.0, 1.9, 1.9, True), (1.0, 2.1, 0.0, False), (1.0, 0.0, 2.1, False),
        (20.0, 5.9, 5.9, True), (20.0, 6.1, 0.0, False), (20.0, 0.0, 6.1, False),
    ],
)  # fmt: skip
def test_two_metres_or_three_tenths_of_what_agrees_may_contradict_in_either_map(
    matched_m: float, a_against_m: float, b_against_m: float, is_fine: bool
) -> None:
    assert agrees(walls(matched_m, a_against_m, b_against_m)) == is_fine


def test_nothing_that_was_examined_speaks_against_a_place() -> None:
    assert agrees(None)


@pytest.mark.parametrize(
    ("evidence", "is_kept"),
    [(walls(5.1, 0.0, 0.0), True), (walls(4.9, 0.0, 0.0), False), (walls(5.1, 3.0, 0.0), False), (None, False)],
)
def test_a_place_is_kept_where_enough_wall_agrees_and_little_contradicts(
    evidence: Evidence | None, is_kept: bool
) -> None:
    assert is_worth_keeping(Rejection("too little", 0.3, evidence, "auto", HERE)) == is_kept


def test_an_alignment_is_kept_whatever_its_walls() -> None:
    assert is_worth_keeping(Alignment(HERE, 0.9, walls(1.0, 9.0, 9.0), np.eye(3), "auto"))


@pytest.mark.parametrize(
    ("matched_m", "off_m", "by_walls"), [(FITTED_M, 0.2, True), (FITTED_M - 0.1, 0.2, False), (FITTED_M, 9.0, False)]
)
def test_where_robots_saw_each_other_walls_say_better_where_the_maps_lie_if_enough_agree_there(
    matched_m: float, off_m: float, by_walls: bool
) -> None:
    place = Hypothesis(HERE, "sight", 0)
    fitted = HERE + np.array([off_m, 0.0, 0.0])
    found = by_sight(place, Rejection("too little", 0.4, walls(matched_m, 0.0, 0.0), "auto", fitted))
    assert np.array_equal(found.T_a_b, fitted if by_walls else HERE)


@pytest.mark.parametrize(
    ("own", "told", "is_merged"),
    [
        (0, -2.0, False),  # r2 looked twice where r1 should be
        (0, -1.9, True),
        (2, 0.0, False),  # r1 did where r2 should be
        (1, -1.0, False),  # each did once
        (2, 6.0, True),  # r2 saw r1
    ],
)
def test_maps_alone_do_not_merge_a_pair_where_robots_looked_twice_and_saw_nobody(
    own: int, told: float, is_merged: bool
) -> None:
    places = Hypotheses()
    place = places.add(HERE, "maps", 0)
    assert place is not None
    place.own, place.told = Sightings(not_there=own), {"r2": told}
    outcome = weighed(places, Alignment(HERE, 0.9, walls(60.0, 0.0, 0.0), np.eye(3), "auto"))
    assert isinstance(outcome, Alignment) == is_merged
    assert is_merged or (isinstance(outcome, Rejection) and "nobody was there" in outcome.reason)
    assert not place.is_refuted


@pytest.mark.parametrize(
    ("here", "there", "is_merged"),
    [
        (0.0, 4.0, False),  # twice where the robots would be elsewhere, never here
        (0.0, 2.9, True),
        (2.0, 4.0, True),
        (-1.0, 2.0, False),
        (2.0 * MOST_HIDDEN_LLR, 0.0, True),  # robots too low for each other's lasers, seen nowhere
        (4.0, 6.0, False),  # three sightings there outweigh two here
    ],
)
def test_maps_do_not_lie_where_they_fit_if_the_robots_rather_saw_each_other_elsewhere(
    here: float, there: float, is_merged: bool
) -> None:
    places = Hypotheses()
    for T, llr in ((HERE, here), (THERE, there)):
        place = places.add(T, "maps", 0)
        assert place is not None
        place.told = {"r1": llr / 2.0, "r2": llr / 2.0}
    outcome = weighed(places, Alignment(HERE, 0.9, walls(60.0, 0.0, 0.0), np.eye(3), "auto"))
    assert isinstance(outcome, Alignment) == is_merged
    assert is_merged or (isinstance(outcome, Rejection) and "with the maps -4.0, 3.0 m apart" in outcome.reason)


def fix_at(T_a_b: se2.Transform) -> MutualFix:
    return MutualFix(T_a_b, np.eye(3) * 1e-4, 3)


@pytest.mark.parametrize(
    ("here", "fixed", "other", "is_merged"),
    [
        (0.0, 1.0, 2.0, False),  # bearings of both say more than one body elsewhere
        (2.0, 1.0, 0.0, True),  # and less than what was seen here since
        (1.0, 1.0, 0.0, False),
    ],
)
def test_a_place_that_two_robots_sight_of_each_other_proposed_is_ahead_unless_more_was_seen_here(
    here: float, fixed: float, other: float, is_merged: bool
) -> None:
    places = Hypotheses()
    for T, llr in ((HERE, here), (THERE, fixed), (se2.transform(20.0, 0.0, 0.0), other)):
        place = places.add(T, "maps", 0)
        assert place is not None
        place.told, place.fix = {"r2": llr}, fix_at(T) if T is THERE else None
    outcome = weighed(places, Alignment(HERE, 0.9, walls(60.0, 0.0, 0.0), np.eye(3), "auto"))
    assert isinstance(outcome, Alignment) == is_merged


def test_of_two_places_where_robots_saw_each_other_that_fit_alike_more_sightings_decide() -> None:
    places = Hypotheses()
    for T, llr in ((HERE, 6.0), (THERE, 12.0)):
        place = places.add(T, "maps", 0)
        assert place is not None
        place.told = {"r1": llr / 2.0, "r2": llr / 2.0}
    found = weighed(places, Rejection("ambiguous", 0.4, walls(30.0, 0.0, 0.0), "auto", HERE, rivals=(THERE,)))
    assert isinstance(found, Alignment) and np.array_equal(found.T_a_b, THERE)


def test_where_nobody_looked_counts_as_little_as_where_nothing_was_seen() -> None:
    places = Hypotheses()
    place = places.add(THERE, "maps", 0)
    assert place is not None
    place.told = {"r2": 4.0}
    assert isinstance(weighed(places, Alignment(HERE, 0.9, walls(60.0, 0.0, 0.0), np.eye(3), "auto")), Rejection)


def test_a_better_estimate_of_the_place_where_robots_saw_each_other_is_no_other_place() -> None:
    places = Hypotheses()
    place = places.add(HERE, "sight", 0)
    assert place is not None
    place.told = {"r2": 4.0}
    corrected = HERE + np.array([1.5, 0.0, 0.0])
    assert isinstance(weighed(places, Alignment(corrected, 0.9, walls(60.0, 0.0, 0.0), np.eye(3), "auto")), Alignment)
