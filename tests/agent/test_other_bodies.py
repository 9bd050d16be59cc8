"""A body that is a placed teammate speaks for no place of another one."""

from __future__ import annotations

import numpy as np

from mrslam.agent import Agent
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.witness import Witness
from mrslam.comms import TeammatePose
from mrslam.mutual_detection import MutualDetectionConfig
from mrslam.spatial import se2
from tests.agent.duo import S
from tests.agent.sightings import BEGIN, merge_pair, met
from tests.mutual_detection.sights import sweep
from tests.mutual_detection.test_encounters import FRAMES, MATE, OWN, RIGHT

BESIDE = se2.compose(RIGHT, se2.transform(0.1, 0.1, 0.0))
"""Where r3's map would have r3 stand 0.14 m beside r2."""
LOOK_S = 0.5


def three() -> tuple[Agent, Hypothesis]:
    """Return a robot that knows the maps of r2 and r3, and where r3's would lie."""
    one = met()
    one.team.take_map("r3", one.team.maps["r2"])
    place = one.team.beliefs["r1", "r3"].places.add(BESIDE, "maps", 0)
    assert place is not None
    return one, place


def drive(one: Agent, *, r2_epoch: int | None = None, order: tuple[str, str] = ("r2", "r3")) -> Witness:
    """Let r1 see r2 drive towards it, while r2 and r3 say that they are at that place of their maps."""
    witness = Witness("r1", MutualDetectionConfig(teammates_visible=True))
    witness.look(one.team, BEGIN)
    epochs = {"r2": r2_epoch or one.team.maps["r2"].epoch, "r3": one.team.maps["r3"].epoch}
    for k, (own, mate) in enumerate(zip(OWN, MATE, strict=True)):
        t_ns = BEGIN + k * S
        witness.on_scan(sweep(own, [mate[:2]], seed=k), se2.between(FRAMES[0], own), t_ns)
        for name in order:
            report = TeammatePose(name, t_ns, se2.between(FRAMES[1], mate), epochs[name], np.empty((0, 2)))
            witness.on_report(report, one.team, t_ns)
        witness.look(one.team, t_ns + int(LOOK_S * S))
    return witness


def seen(place: Hypothesis) -> int:
    assert place.own is not None
    return place.own.seen


def test_a_body_that_is_a_placed_teammate_does_not_count_as_another_in_whatever_order_they_report() -> None:
    for order in (("r2", "r3"), ("r3", "r2")):
        one, place = three()
        merge_pair(one, ("r1", "r2"), RIGHT)
        drive(one, order=order)
        right = one.team.beliefs["r1", "r2"].places.at(RIGHT)
        assert right is not None and seen(right) >= 3 and right.is_supported
        assert seen(place) == 0 and not place.is_supported


def test_a_body_that_nobody_else_explains_counts() -> None:
    for r2_epoch in (None, 77):  # r2 is not placed; r2 is, but says where it is in another map
        one, place = three()
        if r2_epoch is not None:
            merge_pair(one, ("r1", "r2"), RIGHT)
        drive(one, r2_epoch=r2_epoch)
        assert seen(place) >= 3 and place.is_supported


def test_bodies_are_weighed_again_once_a_teammate_is_placed_that_they_may_have_been() -> None:
    one, place = three()
    witness = drive(one)
    assert place.is_supported
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness.look(one.team, BEGIN + 20 * S)
    assert seen(place) == 0 and not place.is_supported
    merge_pair(one, ("r1", "r3"), se2.transform(9.0, 9.0, 0.0))
    was = one.team.beliefs["r1", "r2"].places.at(RIGHT)
    witness.look(one.team, BEGIN + 21 * S)
    assert was is not None and seen(was) >= 3


def test_nothing_counts_twice_when_a_teammate_is_placed() -> None:
    one, _ = three()
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness = drive(one)
    right = one.team.beliefs["r1", "r2"].places.at(RIGHT)
    assert right is not None
    before = seen(right)
    merge_pair(one, ("r1", "r3"), se2.transform(9.0, 9.0, 0.0))
    witness.look(one.team, BEGIN + 20 * S)
    assert seen(right) == before


def test_a_teammate_that_is_placed_does_not_explain_its_own_body_away() -> None:
    one, _ = three()
    place = one.team.beliefs["r1", "r2"].places.add(BESIDE, "maps", 0)
    assert place is not None
    witness = drive(one)
    merge_pair(one, ("r1", "r2"), RIGHT)
    witness.look(one.team, BEGIN + 20 * S)
    assert seen(place) >= 3 and place.is_supported


def test_a_map_that_is_dropped_between_sighting_and_look_is_not_weighed() -> None:
    one, _ = three()
    witness = drive(one)
    witness.on_scan(sweep(OWN[0], [MATE[0][:2]]), se2.between(FRAMES[0], OWN[0]), BEGIN + 20 * S)
    report = TeammatePose("r3", BEGIN + 20 * S, se2.between(FRAMES[1], MATE[0]), one.team.maps["r3"].epoch)
    witness.on_report(report, one.team, BEGIN + 20 * S)
    one.team.displace("r3")
    del one.team.maps["r3"], one.team.beliefs["r1", "r3"], one.team.beliefs["r2", "r3"]
    assert witness.look(one.team, BEGIN + 21 * S) == []
