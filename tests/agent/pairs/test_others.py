"""Which pairs of two others a robot searches for itself, and when."""

from __future__ import annotations

from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.others import LOOP_NS, TRIES_ENOUGH, is_left_to_others
from tests.agent.pairs.floors import found

OTHERS, OWN = ("r1", "r3"), (("r1", "r2"), ("r2", "r3"))


def beliefs(tries: int) -> dict[tuple[str, str], PairBelief]:
    return {OTHERS: PairBelief()} | {pair: PairBelief(attempts=tries) for pair in OWN}


def test_two_others_are_left_to_find_their_pair_until_their_maps_were_looked_for_in_the_own_one() -> None:
    for placed in ({"r2"}, {"r1", "r2"}):
        assert is_left_to_others("r2", OTHERS, beliefs(TRIES_ENOUGH - 1), placed, 0)
        assert not is_left_to_others("r2", OTHERS, beliefs(TRIES_ENOUGH), placed, 0)
    assert not any(is_left_to_others("r2", pair, beliefs(0), {"r2"}, 0) for pair in OWN)


def test_a_map_that_is_merged_with_the_own_one_needs_no_more_tries() -> None:
    known = beliefs(TRIES_ENOUGH)
    known["r1", "r2"] = PairBelief(status="accepted", attempts=2)
    known["r1", "r2"].stability.believed = found()
    assert not is_left_to_others("r2", OTHERS, known, {"r1", "r2"}, 0)


def test_the_loop_of_two_that_are_placed_is_awaited_for_a_while() -> None:
    known = beliefs(2)
    for belief, at_ns in zip((known[pair] for pair in OWN), (5, 7), strict=True):
        belief.accepted_at_ns = at_ns
    assert is_left_to_others("r2", OTHERS, known, {"r1", "r2", "r3"}, 6 + LOOP_NS)
    assert not is_left_to_others("r2", OTHERS, known, {"r1", "r2", "r3"}, 7 + LOOP_NS)


def test_a_pair_found_is_confirmed_here_and_a_base_station_leaves_nothing_to_others() -> None:
    known = beliefs(0)
    known[OTHERS].stability.believed = found()
    assert not is_left_to_others("r2", OTHERS, known, {"r2"}, 0)
    assert not is_left_to_others("base", OTHERS, beliefs(0), set(), 0)
