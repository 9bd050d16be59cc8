"""An alignment is not believed that puts two others where they did not meet."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.through import unless_refuted
from mrslam.alignment import Alignment, Rejection
from mrslam.merge import Pair
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform
from tests.agent.pairs.floors import Floors, found, say, walls

T_1_2, T_2_3 = se2.transform(1.0, 2.0, 0.5), se2.transform(-3.0, 1.0, 2.0)
BY_WAY = se2.compose(T_1_2, T_2_3)
"""Where r3's map lies in r1's by way of r2's."""
ELSEWHERE = se2.transform(9.0, -6.0, -1.0)


def aligned(T_a_b: Transform, confidence: float) -> Alignment:
    return Alignment(T_a_b, confidence, walls(60.0, 0.0), np.eye(3) * 1e-4, "auto")


def believed(confidence: float) -> dict[Pair, PairBelief]:
    """r1 and r2 are merged, with this confidence."""
    merged = PairBelief()
    merged.stability.believed = aligned(T_1_2, confidence)
    return {("r1", "r2"): merged, ("r1", "r3"): PairBelief(), ("r2", "r3"): PairBelief()}


@pytest.mark.parametrize(
    ("place", "llr", "confidence", "refused_as"),
    [
        (BY_WAY, -2.0, 0.95, "r1 and r3 looked where the other should be, and nobody was there"),
        (BY_WAY, -1.0, 0.95, None),
        (ELSEWHERE, 4.0, 0.95, "r1 and r3 saw each other with the maps 9.0, -6.0 m apart"),
        (ELSEWHERE, 2.0, 0.95, None),
        (BY_WAY, 4.0, 0.95, None),
        (ELSEWHERE, -6.0, 0.95, None),
        (BY_WAY, -6.0, 0.7, None),  # the weaker of the two alignments is the other one
        (ELSEWHERE, 4.0, 0.7, None),
    ],
)
def test_the_weakest_alignment_yields_to_what_two_robots_saw_that_it_would_place(
    place: Transform, llr: float, confidence: float, refused_as: str | None
) -> None:
    beliefs = believed(confidence)
    say(beliefs["r1", "r3"], place, llr)
    outcome = unless_refuted(("r2", "r3"), aligned(T_2_3, 0.8), beliefs)
    assert isinstance(outcome, Alignment) == (refused_as is None)
    assert refused_as is None or (isinstance(outcome, Rejection) and refused_as in outcome.reason)


@pytest.mark.parametrize(
    ("place", "llr", "seen_llr", "is_refused"),
    [(BY_WAY, -2.0, 4.0, False), (BY_WAY, -6.0, 4.0, True), (ELSEWHERE, 4.0, 6.0, False), (ELSEWHERE, 6.0, 4.0, True)],
)
def test_an_alignment_stands_whose_robots_saw_each_other_there_more_surely(
    place: Transform, llr: float, seen_llr: float, is_refused: bool
) -> None:
    """One of the two others may have been carried, and tell for a while that it is where it was."""
    beliefs = believed(0.95)
    for pair, at, told in ((("r1", "r3"), place, llr), (("r2", "r3"), T_2_3, seen_llr)):
        say(beliefs[pair], at, told, pair[0])
    outcome = unless_refuted(("r2", "r3"), aligned(T_2_3, 0.8), beliefs)
    assert isinstance(outcome, Rejection) == is_refused


def test_what_two_robots_saw_is_asked_of_the_pair_itself_elsewhere() -> None:
    beliefs = believed(0.95)
    say(beliefs["r2", "r3"], ELSEWHERE, 4.0, "r2")
    assert isinstance(unless_refuted(("r2", "r3"), aligned(T_2_3, 0.8), beliefs), Alignment)


@pytest.mark.parametrize(("llr", "is_refused"), [(5.0, True), (6.0, False)])
def test_an_alignment_counts_before_it_is_believed_as_it_will_after(llr: float, is_refused: bool) -> None:
    """Of two that robots saw the first by names is the weaker one; of any other the one that they did not see."""
    beliefs = believed(0.95)
    for pair, at, said_llr in (
        (("r1", "r2"), T_1_2, 6.0),
        (("r2", "r3"), T_2_3, llr),
        (("r1", "r3"), ELSEWHERE, 7.0),
    ):
        say(beliefs[pair], at, said_llr, pair[0])
    outcome = unless_refuted(("r2", "r3"), aligned(T_2_3, 0.8), beliefs)
    assert isinstance(outcome, Rejection) == is_refused


def test_what_speaks_most_against_where_an_alignment_leads_others_counts() -> None:
    beliefs = believed(0.95)
    for pair, at, llr in ((("r1", "r3"), BY_WAY, -2.0), (("r1", "r3"), ELSEWHERE, 7.0), (("r2", "r3"), T_2_3, 4.0)):
        say(beliefs[pair], at, llr, pair[0])
    outcome = unless_refuted(("r2", "r3"), aligned(T_2_3, 0.8), beliefs)
    assert isinstance(outcome, Rejection) and "saw each other with the maps 9.0, -6.0 m apart" in outcome.reason


@pytest.mark.parametrize("is_refused", [False, True])
def test_a_search_that_is_refused_for_what_others_saw_has_found_nothing(is_refused: bool) -> None:
    team = Floors("r1", "r2", "r3")
    for attempt in range(2):
        team.end(team.job_of("r2", "r3", attempt), found(0.0), float(attempt))
    if is_refused:
        say(team.beliefs["r1", "r3"], ELSEWHERE, 7.0)
    team.end(team.job_of("r1", "r2"), found(1.0, 0.8), 2.0)
    assert team.beliefs["r1", "r2"].search.accepted != is_refused
