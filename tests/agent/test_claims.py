"""What robots tell each other of what they saw, how often, and what of it counts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mrslam.agent.early_claims import MOST, EarlyClaims
from mrslam.agent.pairs import hypotheses
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.witness import CHANGED_LLR, REPEAT_NS, Witness
from mrslam.comms import PeerSeen, TeammateClaim, TeammatePose
from mrslam.comms.effects import EPOCHS
from mrslam.merge.graph.edges import pair_of
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.mutual_detection.encounters import MOST_SEEN_LLR, MOST_UNSEEN_LLR
from mrslam.spatial import se2
from tests.agent.duo import S, merge
from tests.agent.sightings import BEGIN, NEARER, claim, merge_pair, met, through_r3, watch
from tests.mutual_detection.test_encounters import OWN, RIGHT


def test_claims_are_made_when_they_change_and_repeated_seldom() -> None:
    one = met()
    merge(one, RIGHT.tolist())
    one.team.beliefs["r1", "r2"].places.add(NEARER, "maps", 0)
    witness, _ = watch(one)
    now_ns = BEGIN + 9 * S
    told = {round(llr): T for peer, T, llr, _ in witness.claims(one.team, now_ns)}
    assert set(told) == {6, -3}
    np.testing.assert_allclose(told[6], RIGHT, atol=1e-9)
    assert witness.claims(one.team, now_ns + 2 * S) == []
    epoch = one.team.maps["r2"].epoch
    witness.on_report(TeammatePose("r2", 0, np.zeros(3), epoch), one.team, now_ns + REPEAT_NS)  # still in contact
    assert len(witness.claims(one.team, now_ns + REPEAT_NS)) == 2


def test_a_claim_is_made_again_where_it_changed_by_a_sighting_and_not_within_a_second() -> None:
    one = met()
    merge(one, RIGHT.tolist())
    witness, _ = watch(one)
    (place,) = one.team.beliefs["r1", "r2"].places
    now_ns = BEGIN + (len(OWN) - 1) * S  # of the last report
    assert place.own is not None and [llr for _, _, llr, _ in witness.claims(one.team, now_ns)] == [place.own.llr]
    before = place.own
    place.own = replace(before, seen=before.seen - 2)
    assert abs(place.own.llr - before.llr) > CHANGED_LLR
    assert witness.claims(one.team, now_ns + S // 2) == []
    assert [llr for _, _, llr, _ in witness.claims(one.team, now_ns + S)] == [place.own.llr]
    assert witness.claims(one.team, now_ns + 2 * S) == []


def test_what_was_seen_of_a_robot_that_is_gone_is_told_again_to_whoever_comes_into_reach() -> None:
    one = met()
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness, _ = watch(one)
    one._witness = witness
    gone_ns = BEGIN + 2 * REPEAT_NS
    assert len(witness.claims(one.team, gone_ns)) == 1  # to robots that are placed by way of r2's map
    assert witness.claims(one.team, gone_ns + 2 * REPEAT_NS) == []
    one._follow([PeerSeen("r3", 1, "robot")], gone_ns + 2 * REPEAT_NS)
    assert len(witness.claims(one.team, gone_ns + 2 * REPEAT_NS)) == 1


def test_bodies_are_reported_until_the_teammate_is_seen_where_it_is_placed() -> None:
    one = met()
    witness, _ = watch(one)
    assert witness.bodies_m(one.team, BEGIN + 9 * S) is not None
    merge(one, RIGHT.tolist())
    assert witness.bodies_m(one.team, BEGIN + 9 * S) is not None  # what was seen is not weighed yet
    witness.look(one.team, BEGIN + 9 * S)
    assert witness.bodies_m(one.team, BEGIN + 9 * S) is None


def test_no_bodies_are_reported_of_a_teammate_that_is_placed_by_way_of_others_until_it_is_missed_there() -> None:
    for T_r1_r2, is_settled in ((RIGHT, True), (NEARER, False)):
        one = met()
        through_r3(one, T_r1_r2)
        witness, _ = watch(one)
        assert (witness.bodies_m(one.team, BEGIN + 9 * S) is None) == is_settled


@pytest.mark.parametrize("own", ["r1", "r3"])
def test_what_is_seen_is_said_of_the_same_place_whatever_the_order_of_names(own: str) -> None:
    one = met(own)
    right, nearer = (T if own < "r2" else se2.inverse(T) for T in (RIGHT, NEARER))
    places = one.team.beliefs[pair_of(own, "r2")].places
    place = places.add(right, "maps", 0)
    witness, _ = watch(one)
    assert place is not None and place.own is not None and place.own.seen >= 3 and place.own.not_there == 0
    wrong = places.add(nearer, "maps", 0)  # weighed by what was seen before
    witness.look(one.team, BEGIN + 9 * S)
    assert wrong is not None and wrong.own is not None and wrong.own.seen == 0 and wrong.own.not_there >= 3
    told = {llr > 0.0: T_own_other for _, T_own_other, llr, _ in witness.claims(one.team, BEGIN + 9 * S)}
    np.testing.assert_allclose(told[True], RIGHT, atol=1e-9)
    np.testing.assert_allclose(told[False], NEARER, atol=1e-9)


def test_nothing_is_claimed_of_a_map_that_its_robot_gave_up() -> None:
    one = met()
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness, _ = watch(one)
    t_ns = BEGIN + 40 * S
    epoch = one.team.maps["r2"].epoch
    for reported, claims in ((epoch + 1, 0), (epoch, 1)):  # r2's new map has not come yet
        witness.on_report(TeammatePose("r2", t_ns, np.zeros(3), reported, np.empty((0, 2))), one.team, t_ns)
        assert len(witness.claims(one.team, t_ns)) == claims


@pytest.mark.parametrize(("of_peer", "of_robot", "counts"), [(0, 0, True), (1, 0, False), (0, 1, False)])
def test_a_claim_counts_for_the_maps_that_it_is_about_alone(of_peer: int, of_robot: int, counts: bool) -> None:
    one = met()
    made = claim(one, RIGHT, 6.0)
    about = (made.of_robot or 0) + of_robot
    Witness("r1", MutualDetectionConfig()).on_claim(
        replace(made, epoch=made.epoch + of_peer, of_robot=about), one.team, BEGIN
    )
    assert bool(list(one.team.beliefs["r1", "r2"].places)) == counts


def test_what_was_told_of_places_that_are_gone_is_forgotten() -> None:
    one = met()
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness, _ = watch(one)
    assert witness.claims(one.team, BEGIN + 9 * S) and witness._told
    one.team.beliefs["r1", "r2"] = PairBelief()
    assert not witness.claims(one.team, BEGIN + 10 * S) and not witness._told


@pytest.mark.parametrize(("claimed", "counted"), [(99.0, MOST_SEEN_LLR), (-99.0, MOST_UNSEEN_LLR), (1.5, 1.5)])
def test_a_claim_counts_for_no_more_than_sightings_can_say(claimed: float, counted: float) -> None:
    one = met()
    Witness("r1", MutualDetectionConfig()).on_claim(claim(one, RIGHT, claimed), one.team, BEGIN)
    (place,) = one.team.beliefs["r1", "r2"].places
    assert place.told == {"r2": counted}


def test_a_claim_about_a_map_that_has_not_come_counts_when_it_has() -> None:
    one = met()
    witness = Witness("r1", MutualDetectionConfig())
    epoch = one.team.maps["r2"].epoch
    early = TeammateClaim("r2", epoch, "r3", se2.inverse(RIGHT), 4.0, epoch % EPOCHS)
    witness.on_claim(early, one.team, BEGIN)
    witness.look(one.team, BEGIN)
    assert ("r2", "r3") not in one.team.beliefs
    one.team.take_map("r3", one.team.maps["r2"])  # of the same epoch
    witness.look(one.team, BEGIN + S)
    (place,) = one.team.beliefs["r2", "r3"].places
    assert place.told == {"r2": 4.0}
    np.testing.assert_allclose(place.T_a_b, se2.inverse(RIGHT))
    place.told.clear()
    witness.look(one.team, BEGIN + 2 * S)
    assert not place.told  # it was taken once


def early(k: int = 0, *, epoch: int = 5, of_robot: int = 6, peer: str = "r2", llr: float = 1.0) -> TeammateClaim:
    """Return a claim of a place ``k`` times 10 m away."""
    return TeammateClaim(peer, epoch, "r3", np.array([10.0 * k, 0.0, 0.0]), llr, of_robot)


def test_of_claims_about_maps_that_are_not_here_the_newest_of_each_place_is_kept() -> None:
    claims = EarlyClaims()
    for made in (early(0), early(1), early(0, llr=2.0)):
        claims.keep(made)
    assert claims.take({"r2": 5}) == [] and claims.take({"r2": 5, "r3": 7}) == []
    assert [(one.T_peer_robot[0], one.llr) for one in claims.take({"r2": 5, "r3": 6})] == [(10.0, 1.0), (0.0, 2.0)]
    assert claims.take({"r2": 5, "r3": 6}) == []


@pytest.mark.parametrize("newer", [{"epoch": 8}, {"of_robot": 8}])
def test_claims_about_a_map_that_was_given_up_are_kept_no_longer(newer: dict[str, int]) -> None:
    claims = EarlyClaims()
    claims.keep(early(0))
    claims.keep(early(1, **newer))
    assert claims.take({"r2": 5, "r3": 6}) == []
    assert len(claims.take({"r2": newer.get("epoch", 5), "r3": newer.get("of_robot", 6)})) == 1


def test_claims_that_are_kept_are_bounded() -> None:
    claims = EarlyClaims()
    for k in range(2 * MOST):
        for place in range(2 * hypotheses.MOST):
            claims.keep(early(place, peer=f"p{k}"))
    taken = [claims.take({f"p{k}": 5, "r3": 6}) for k in range(2 * MOST)]
    assert [len(one) for one in taken] == [0] * MOST + [hypotheses.MOST] * MOST
    assert taken[-1][-1].T_peer_robot[0] == 10.0 * (2 * hypotheses.MOST - 1)
