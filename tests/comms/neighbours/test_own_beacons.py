"""What a robot's own beacons say, and how often they say it."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mrslam.comms import CommsNode, Send
from mrslam.comms.config import MODES
from mrslam.comms.effects import EPOCHS
from mrslam.comms.wire.messages import Beacon, decode
from tests.comms.team import QUICK, SECOND, big_map

BOOT = 7
HERE = np.array([1.5, -2.0, 0.25])
HERE_SENT = (1500, -2000, 2500)


def beacons(node: CommsNode, first_s: float, count: int = 1) -> list[Beacon]:
    """Return the beacons of so many seconds, one each."""
    sent = []
    for k in range(count):
        for effect in node.on_tick(round((first_s + 2 * k) * SECOND)):
            if isinstance(effect, Send) and effect.lane == "beacon":
                sent.append(decode(effect.payload, node.team_tag, 1 << 16))
    assert len(sent) == count
    return sent


@pytest.fixture
def node() -> CommsNode:
    return CommsNode("a", "team", BOOT, QUICK, seed=1)


def test_pose_and_its_age_are_told(node):
    assert beacons(node, 0)[0].pose is None
    node.set_own_pose(HERE, 3 * SECOND)
    assert beacons(node, 3.75)[0].pose == (*HERE_SENT, 750)


def test_time_and_number_go_on_from_the_first_tick(node):
    said = beacons(node, 10, 4)
    assert [beacon.uptime_ms for beacon in said] == [0, 2000, 4000, 6000]
    assert [beacon.seq for beacon in said] == [1, 2, 3, 4]


@pytest.mark.parametrize("mode", MODES[:2])
def test_the_mode_is_told(mode):
    node = CommsNode("a", "team", BOOT, QUICK, mode=mode, seed=1)
    assert beacons(node, 0)[0].mode == MODES.index(mode)


def test_whose_map_it_is_is_told(node):
    node.publish(big_map(200), 0)
    before = beacons(node, 0)[0].epoch
    node.begin_map()
    assert before == BOOT and beacons(node, 2)[0].epoch == node.store.own_epoch != before


def test_the_nearest_bodies_are_told_once(node):
    bodies = np.array([[float(k), -0.5 * k] for k in range(12, 0, -1)])
    node.set_own_pose(HERE, 0, bodies)
    first, second = beacons(node, 0, 2)
    assert first.bodies == tuple((100 * k, -50 * k) for k in range(1, 9))
    assert second.bodies == () and second.pose is not None


def test_bodies_are_those_of_the_last_pose(node):
    node.set_own_pose(HERE, 0, np.array([[1.0, 2.0]]))
    node.set_own_pose(HERE, SECOND, None)
    assert beacons(node, 1)[0].bodies == ()


def test_claims_are_told_once_the_newest_of_a_place_and_eight_at_a_time(node):
    places = [np.array([k, 0.0, 0.0]) for k in range(10)]
    node.add_claims([("b", place, 1.0, EPOCHS + 5) for place in places])
    node.add_claims([("b", places[0], -2.34, 6)])
    first, second, third = beacons(node, 0, 3)
    assert first.claims[0] == ("b", 0, 0, 0, -23) and first.claimed == (6, *(5,) * 7)
    assert [claim[1] for claim in first.claims] == [1000 * k for k in range(8)]
    assert second.claims == (("b", 8000, 0, 0, 10), ("b", 9000, 0, 0, 10)) and second.claimed == (5, 5)
    assert third.claims == ()


def test_hints_are_told_once_and_eight_at_a_time(node):
    node.add_hints([("b", np.array([k, 0.0, math.pi / 2])) for k in range(11)])
    first, second, third = beacons(node, 0, 3)
    assert first.hints == tuple(("b", 1000 * k, 0, 15708) for k in range(8))
    assert [hint[1] for hint in second.hints] == [8000, 9000, 10000]
    assert third.hints == ()


def test_places_in_saved_maps_are_told_apart_for_older_programs_refuse_their_names(node):
    node.add_hints([(f"office@{k}", np.array([k, 0.0, math.pi / 2])) for k in range(11)] + [("b", HERE)])
    first, second, third = beacons(node, 0, 3)
    assert first.saved_hints == tuple((f"office@{k}", 1000 * k, 0, 15708) for k in range(8))
    assert [name for name, *_ in first.hints] == ["b"] and second.hints == ()
    assert [name for name, *_ in second.saved_hints] == ["office@8", "office@9", "office@10"]
    assert third.saved_hints == ()
    cost = node.sightings_bytes
    node.add_hints([("office@11", HERE)])
    node.begin_map()
    (said,) = beacons(node, 6)
    assert said.saved_hints == () and node.sightings_bytes == cost > 100


def test_what_was_said_of_a_map_that_was_given_up_is_not_told(node):
    node.set_own_pose(HERE, 0, np.array([[1.0, 2.0]]))
    node.add_claims([("b", HERE, 1.0, 5)])
    node.add_hints([("b", HERE)])
    node.begin_map()
    (said,) = beacons(node, 0)
    assert said.pose is None and (said.bodies, said.claims, said.hints) == ((), (), ())


def test_what_sightings_cost_is_counted(node):
    beacons(node, 0)
    assert node.sightings_bytes == 0
    node.add_hints([("b", HERE)])
    beacons(node, 2, 2)
    assert 10 <= node.sightings_bytes <= 30
