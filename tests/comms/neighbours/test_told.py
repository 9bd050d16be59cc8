"""What teammates tell of themselves in beacons: places, claims and hints, and of which maps they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as replace_fields

from mrslam.comms import (
    CommsNode,
    TeammateClaim,
    TeammateHint,
    TeammatePose,
)
from mrslam.comms.wire.messages import Beacon, decode, encode
from mrslam.spatial import LocalMap, TiledMap
from tests.comms.neighbours.beacon_at import TAG, beacon_at
from tests.comms.team import QUICK, SECOND, Team, big_map


def test_where_a_teammate_is_arrives_with_its_age_not_its_clock():
    team = Team("ab", config=replace(QUICK, beacon_period_s=0.25))
    team.run(2)
    taken_ns = team.now_ns - 5 * SECOND
    team.nodes["a"].set_own_pose(np.array([1.2345, -2.0, 0.5]), taken_ns)
    team.step()
    team.step()
    seen = team.of(TeammatePose, "b")[-1]
    assert seen.peer == "a"
    assert seen.T_map_base == pytest.approx([1.2345, -2.0, 0.5], abs=6e-4)
    assert abs(seen.stamp_ns - taken_ns) < 0.6 * SECOND
    count = len(team.of(TeammatePose, "b"))
    team.run(3)
    assert len(team.of(TeammatePose, "b")) == count  # the same pose is told once


def test_what_a_teammate_saw_arrives_with_its_pose_and_costs_nothing_when_it_saw_nothing():
    team = Team("ab", config=replace(QUICK, beacon_period_s=0.25))
    team.run(2)
    a = team.nodes["a"]
    assert a.sightings_bytes == 0
    seen_m = np.array([[9.0 - k, 0.5] for k in range(9)])
    a.set_own_pose(np.array([1.0, 2.0, 0.5]), team.now_ns, seen_m)
    a.add_claims([("b", np.array([-3.0, 4.0, 2.0]), -2.96, 2**40 + 7)])
    team.run(0.5)
    pose, claim = team.of(TeammatePose, "b")[-1], team.of(TeammateClaim, "b")[-1]
    np.testing.assert_allclose(pose.bodies_m, seen_m[:0:-1], atol=0.006)  # the eight nearest
    assert (claim.peer, claim.robot, claim.llr) == ("a", "b", -3.0)
    assert (claim.epoch, claim.of_robot) == (a.store.own_epoch, 7)
    np.testing.assert_allclose(claim.T_peer_robot, [-3.0, 4.0, 2.0], atol=6e-4)
    assert 40 < a.sightings_bytes < 100
    a.set_own_pose(np.array([2.0, 2.0, 0.5]), team.now_ns)
    team.run(2)
    assert len(team.of(TeammateClaim, "b")) == 1 and not len(team.of(TeammatePose, "b")[-1].bodies_m)


def test_hints_arrive_with_the_epoch_of_their_map_each_once_and_more_than_a_beacon_holds_come_with_the_next():
    team = Team("ab", config=replace(QUICK, beacon_period_s=0.25))
    team.run(2)
    node = team.nodes["a"]
    team.publish("a")
    node.begin_map()
    assert node.store.own_epoch != node.boot_id
    node.add_hints([(f"r{k}", np.array([-3.0, 4.0, 0.1 * k])) for k in range(11)])
    team.run(2)
    hints = team.of(TeammateHint, "b")
    assert [hint.robot for hint in hints] == [f"r{k}" for k in range(11)]
    assert {(hint.peer, hint.epoch) for hint in hints} == {("a", node.store.own_epoch)}
    np.testing.assert_allclose(hints[-1].T_peer_robot, [-3.0, 4.0, 1.0], atol=6e-4)
    assert 100 < node.sightings_bytes < 300


def test_a_place_in_a_saved_map_arrives_with_the_epoch_of_its_map():
    team = Team("ab", config=replace(QUICK, beacon_period_s=0.25))
    team.run(2)
    team.nodes["a"].add_hints([("office@monday", np.array([-3.0, 4.0, 0.1]))])
    team.run(1)
    [hint] = team.of(TeammateHint, "b")
    assert (hint.peer, hint.epoch, hint.robot) == ("a", team.nodes["a"].store.own_epoch, "office@monday")
    np.testing.assert_allclose(hint.T_peer_robot, [-3.0, 4.0, 0.1], atol=6e-4)


def test_more_claims_than_a_beacon_holds_come_with_the_next():
    team = Team("ab", config=replace(QUICK, beacon_period_s=0.25))
    team.run(2)
    team.nodes["a"].add_claims([("b", np.array([float(k), 0.0, 0.0]), 1.0, 1) for k in range(11)])
    team.run(2)
    assert [claim.T_peer_robot[0] for claim in team.of(TeammateClaim, "b")] == list(range(11))


def test_claims_of_a_program_that_does_not_say_of_which_map_of_ours_are_heard():
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    a.add_claims([("b", np.array([1.0, 2.0, 0.0]), 1.0, 7)])
    told = decode(beacon_at(a, 0), TAG, 10_000)
    assert isinstance(told, Beacon) and told.claimed
    heard = b.on_message(encode(replace_fields(told, claimed=[]), TAG), SECOND, "a")
    assert [e.of_robot for e in heard if isinstance(e, TeammateClaim)] == [None]


def test_where_a_teammate_is_says_in_which_of_its_maps():
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    a.publish(big_map(200), 0)
    a.begin_map()
    a.set_own_pose(np.zeros(3), 0)
    (pose,) = [e for e in b.on_message(beacon_at(a, 0), 0, "a") if isinstance(e, TeammatePose)]
    assert pose.epoch == a.store.own_epoch == 2


def test_the_first_beacon_of_a_new_map_says_nothing_of_the_old_one() -> None:
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    a.publish(LocalMap(TiledMap(0.05, {}, 1)), 0)
    a.set_own_pose(np.array([12.0, 3.0, 0.0]), 0, np.ones((1, 2)))
    a.add_hints([("b", np.zeros(3))])
    a.add_claims([("b", np.zeros(3), 2.0, 1)])
    a.begin_map()
    heard = b.on_message(beacon_at(a, 0), 0, "a")
    assert not any(isinstance(effect, TeammatePose | TeammateClaim | TeammateHint) for effect in heard)


def test_the_newest_claim_about_a_place_is_told_and_no_older_one() -> None:
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    for llr in (1.0, 2.0, 3.0):
        a.add_claims([("b", np.zeros(3), llr, 1)])
    claims = [one.llr for one in b.on_message(beacon_at(a, 0), 0, "a") if isinstance(one, TeammateClaim)]
    assert claims == [3.0]
