"""A third robot that is merged with both of a pair chooses between places of the pair that fit alike."""

from __future__ import annotations

import numpy as np
import pytest

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hypotheses import Hypotheses
from mrslam.agent.pairs.loops import SUREST, Loop, loops_of
from mrslam.agent.pairs.weighing import LOOP_METHOD, weighed
from mrslam.alignment import Alignment, Evidence, Rejection, WallEvidence
from mrslam.spatial import se2

POSES = {"r1": se2.transform(1.0, 2.0, 0.3), "r2": se2.transform(-4.0, 7.0, 2.0), "r3": se2.transform(9.0, 3.0, -1.1)}
HERE, THERE = se2.between(POSES["r1"], POSES["r2"]), se2.transform(-3.0, 11.0, 0.2)
WALLS = Evidence(a=WallEvidence(matched_m=30.0), b=WallEvidence(matched_m=30.0))
ALIKE = Rejection("ambiguous", 0.4, WALLS, "auto", THERE, rivals=(HERE,))


def merged(a: str, b: str, confidence: float) -> PairBelief:
    belief = PairBelief()
    belief.stability.believed = Alignment(se2.between(POSES[a], POSES[b]), confidence, WALLS, np.eye(3) * 1e-4, "auto")
    return belief


def seen_by(third: str, pair: tuple[str, str], confidence: float) -> list[Loop]:
    beliefs = {tuple(sorted((name, third))): merged(*sorted((name, third)), confidence) for name in pair}
    return loops_of(pair, {pair: PairBelief(), **beliefs})


@pytest.mark.parametrize(("third", "pair"), [("r3", ("r1", "r2")), ("r2", ("r1", "r3")), ("r1", ("r2", "r3"))])
def test_a_loop_leads_to_where_the_pair_is_whatever_the_order_of_names(third: str, pair: tuple[str, str]) -> None:
    (loop,) = seen_by(third, pair, 0.89)
    np.testing.assert_allclose(loop.T_a_b, se2.between(POSES[pair[0]], POSES[pair[1]]), atol=1e-9)
    assert loop.llr == pytest.approx(np.log(0.89**2 / (1 - 0.89**2)))
    assert seen_by(third, pair, 0.6)[0].llr == 0.0


def test_no_loop_without_both_sides() -> None:
    assert loops_of(("r1", "r2"), {("r1", "r2"): PairBelief(), ("r1", "r3"): merged("r1", "r3", 0.9)}) == []


@pytest.mark.parametrize(
    ("confidence", "llr_here", "llr_there", "is_chosen"),
    [(0.99, 0.0, 0.0, True), (0.89, 0.0, 0.0, False), (0.89, 2.0, 0.0, True), (0.99, 0.0, 2.0, False)],
)
def test_loops_and_sightings_together_choose_between_places_that_fit_alike(
    confidence: float, llr_here: float, llr_there: float, is_chosen: bool
) -> None:
    places = Hypotheses()
    for T, llr in ((THERE, llr_there), (HERE, llr_here)):
        place = places.add(T, "maps", 0)
        assert place is not None
        place.told["r2"] = llr
    found = weighed(places, ALIKE, seen_by("r3", ("r1", "r2"), confidence))
    assert isinstance(found, Alignment) == is_chosen
    if isinstance(found, Alignment):
        np.testing.assert_array_equal(found.T_a_b, HERE)
        assert found.method == LOOP_METHOD


def test_loops_choose_no_place_where_robots_looked_in_vain() -> None:
    places = Hypotheses()
    place = places.add(HERE, "maps", 0)
    assert place is not None
    place.told["r2"] = -6.0
    loops = [Loop(HERE, 6.0)] * 2
    assert weighed(places, ALIKE, loops) is ALIKE


@pytest.mark.parametrize(
    ("llr_here", "llr_there", "is_chosen"), [(3.0, 0.0, True), (2.9, 0.0, False), (4.0, 2.0, False), (0.0, -3.0, False)]
)
def test_sightings_choose_a_place_only_if_they_say_enough_more_for_it(
    llr_here: float, llr_there: float, is_chosen: bool
) -> None:
    places = Hypotheses()
    for T, llr in ((THERE, llr_there), (HERE, llr_here)):
        place = places.add(T, "maps", 0)
        assert place is not None
        place.told["r2"] = llr
    found = weighed(places, ALIKE)
    assert isinstance(found, Alignment) == is_chosen
    assert not isinstance(found, Alignment) or np.array_equal(found.T_a_b, HERE)


def test_a_loop_says_nothing_against_walls() -> None:
    loops = [Loop(HERE, 3.9)] * 2
    fits = Alignment(THERE, 0.7, WALLS, np.eye(3) * 1e-4, "auto")
    assert weighed(Hypotheses(), fits, loops) is fits
    refused = Rejection("walls contradict", 0.1, WALLS, "auto", HERE)
    assert weighed(Hypotheses(), refused, loops) is refused


def test_alignments_of_full_confidence_are_trusted_as_far_as_those_of_robots_that_saw_each_other() -> None:
    assert seen_by("r3", ("r1", "r2"), 1.0)[0].llr == pytest.approx(np.log(SUREST / (1 - SUREST)))
