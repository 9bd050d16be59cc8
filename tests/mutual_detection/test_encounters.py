"""Sightings add up over independent moments, and what they can say is bounded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrslam.agent.pairs.hypotheses import DOUBTED_LLR
from mrslam.mutual_detection import sightings
from mrslam.mutual_detection.encounters import (
    MOST_HIDDEN_LLR,
    MOST_NOT_THERE_LLR,
    MOST_SEEN_LLR,
    MOST_UNSEEN_LLR,
    NOT_THERE_LLR,
    Sightings,
)
from mrslam.spatial import se2
from tests.mutual_detection.sights import RADIUS_M, moment, way

FRAMES = (se2.transform(5.0, 9.0, 0.7), se2.transform(11.0, 4.0, -2.0))
RIGHT = se2.between(*FRAMES)
CORRIDOR_Y = 5.1
"""Middle of a corridor of the world "office"."""
OWN = way((3.0, CORRIDOR_Y), (6.0, CORRIDOR_Y), 9)
MATE = way((9.2, CORRIDOR_Y), (7.0, CORRIDOR_Y), 9, 1.0)


def moments(**options: bool) -> list:
    return [moment(a, b, FRAMES, seed=k, **options) for k, (a, b) in enumerate(zip(OWN, MATE, strict=True))]


def test_the_right_place_is_supported_and_another_contradicted() -> None:
    right = sightings(moments(), RIGHT, RADIUS_M)
    assert right.seen >= 3 and right.not_there == 0 and right.llr == MOST_SEEN_LLR
    nearer = se2.compose(se2.inverse(FRAMES[0]), se2.compose(se2.transform(-1.6, 0.0, 0.0), FRAMES[1]))
    wrong = sightings(moments(), nearer, RADIUS_M)
    assert wrong.seen == 0 and wrong.not_there >= 3 and wrong.llr == MOST_UNSEEN_LLR


def test_a_robot_that_cannot_be_seen_is_not_contradicted_to_death() -> None:
    hidden = [one for k in range(10) for one in moments(hidden=True)]
    found = sightings(hidden, RIGHT, RADIUS_M)
    assert found.not_there > 10 and found.llr == MOST_UNSEEN_LLR
    found.take(moments()[4], RIGHT, RADIUS_M)
    assert found.seen == 1 and found.llr == MOST_NOT_THERE_LLR + 2.0


def test_robots_that_may_be_too_low_for_each_other_refute_nothing_before_they_were_seen() -> None:
    hidden = [one for k in range(10) for one in moments(hidden=True)]
    found = sightings(hidden, RIGHT, RADIUS_M, MOST_HIDDEN_LLR)
    assert found.not_there > 10 and found.llr == MOST_HIDDEN_LLR and 2.0 * found.llr > DOUBTED_LLR
    found.take(moments()[4], RIGHT, RADIUS_M)
    assert found.llr == MOST_NOT_THERE_LLR + 2.0


def test_one_look_in_vain_doubts_a_place_and_takes_back_what_one_body_said() -> None:
    assert Sightings(not_there=1).llr <= DOUBTED_LLR
    assert DOUBTED_LLR < Sightings(seen=1, not_there=1).llr <= 0.0


def test_what_all_bodies_together_say_is_bounded() -> None:
    found = Sightings(seen=9, not_there=1)
    assert found.llr == MOST_SEEN_LLR + NOT_THERE_LLR
    assert Sightings(seen=2).llr == 4.0 < MOST_SEEN_LLR


def test_a_thing_that_stands_still_counts_once() -> None:
    stands = np.array([8.6, CORRIDOR_Y])
    seen = [moment(a, b, FRAMES, [stands], seed=k, hidden=True) for k, (a, b) in enumerate(zip(OWN, MATE, strict=True))]
    found = sightings(seen, RIGHT, RADIUS_M)
    assert found.seen == 1 and found.llr < 2.0


def test_a_body_nearer_to_where_another_teammate_was_is_no_sighting() -> None:
    one, T = moments()[4], se2.compose(RIGHT, se2.transform(0.1, 0.0, 0.0))
    at_m, beside_m, off_m = (one.place_m(RIGHT)[None] + np.array([0.0, dy_m]) for dy_m in (0.0, 0.2, 3.0))
    for others_m, counts in ((at_m, 0), (beside_m, 1), (off_m, 1), (np.vstack([off_m, at_m]), 0)):
        seen = replace(one, bodies_m=np.vstack([off_m, one.bodies_m]), others={"r3": (1, others_m)})
        found = Sightings()
        found.take(seen, T, RADIUS_M, lambda at: at.others["r3"][1])
        assert (found.seen, found.not_there) == (counts, 0)


def test_moments_are_independent_once_a_robot_has_moved() -> None:
    first = moments()[0]
    near, far = (moment(OWN[0] + (step, 0.0, 0.0), MATE[0], FRAMES) for step in (0.25, 0.35))
    assert not near.is_after(first) and far.is_after(first)
    assert moment(OWN[0], MATE[0] - (0.35, 0.0, 0.0), FRAMES).is_after(first)
