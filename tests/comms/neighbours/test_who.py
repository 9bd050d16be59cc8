"""Who is who: arrivals, departures, restarts, twins, and where teammates are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from msgspec.structs import replace as replace_fields

from mrslam.comms import (
    CommsNode,
    DuplicateId,
    ExchangeDone,
    ExchangeStarted,
    LinkChanged,
    LinkConditions,
    PeerGone,
    PeerSeen,
    Send,
    TeammateClaim,
    TeammatePose,
)
from mrslam.comms.config import MODES
from mrslam.comms.neighbours.presence import MOST_BOOTS, DuplicateIdWatch, am_newcomer
from mrslam.comms.wire.messages import Beacon, Bye, decode, encode
from mrslam.spatial import InputError
from tests.comms.neighbours.beacon_at import TAG, beacon_at
from tests.comms.team import QUICK, SECOND, Team, big_map


def test_a_restarted_robots_new_map_takes_the_place_of_its_old_one_even_with_a_lesser_boot_id():
    team = Team("b")
    team.start("a", boot_id=50)
    for _ in range(5):
        team.publish("a")
    assert team.run_until_agreed(10)
    old = team.nodes["b"].store.version("a")
    team.crash("a")
    team.run(5)
    assert [event.peer for event in team.of(PeerGone, "b")] == ["a"]
    team.start("a", boot_id=7)
    team.publish("a")
    assert team.run_until_agreed(20)
    new = team.nodes["b"].store.version("a")
    assert new[0] > old[0]
    assert new == team.nodes["a"].store.version("a")


def test_a_map_begun_anew_is_another_whatever_its_revision():
    team = Team("ab")
    a, b = team.nodes["a"].store, team.nodes["b"].store
    team.nodes["a"].publish(big_map(400, seed=0, revision=1), team.now_ns)
    assert team.run_until(lambda: b.version("a") == a.version("a"), 20)
    old = a.version("a")
    team.nodes["a"].begin_map()
    team.nodes["a"].begin_map()  # said twice, it is still one
    assert a.version("a") == old
    team.nodes["a"].publish(big_map(400, seed=1, revision=3), team.now_ns)
    assert a.version("a") == (old[0] + 1, 3)
    assert team.run_until(lambda: b.version("a") == a.version("a"), 20)
    here, there = (store.maps["a"].map.to_grid().cells for store in (a, b))
    assert np.array_equal(here, there)
    assert np.array_equal(here, big_map(400, seed=1, revision=3).map.to_grid().cells)


def test_a_robot_that_comes_back_gets_all_it_had_known():
    team = Team("ab")
    team.publish("b")
    assert team.run_until_agreed(10)
    team.crash("a")
    team.run(1)
    team.start("a")
    assert team.run_until(lambda: "b" in team.nodes["a"].store.maps, 15)


def test_modes_can_be_mixed():
    team = Team(["m1", "m2", "hub", "d"], modes={"m1": "mapper", "m2": "mapper", "hub": "central"})
    for robot in ("m1", "m2", "d"):
        team.publish(robot)
    team.run(20)
    assert sorted(team.nodes["hub"].store.maps) == ["d", "m1", "m2"]
    assert sorted(team.nodes["d"].store.maps) == ["d", "m1", "m2"]
    assert sorted(team.nodes["m1"].store.maps) == ["m1"]
    assert not [e for e in team.of(ExchangeStarted, "m1") if e.peer == "m2"]
    # Nothing is offered that it does not take.
    assert max(e.costs.bytes_received for e in team.of(ExchangeDone, "m1")) < 250


def test_two_processes_with_one_name_are_both_told_and_the_newcomer_stops():
    old, new = (CommsNode("r", "team", boot, QUICK) for boot in (5, 9))
    found = {}
    now = 0
    for k in range(40):
        now = k * SECOND // 2
        for node, other, name in ((old, new, "old"), (new, old, "new")):
            if name == "new" and k < 10:
                continue
            for effect in node.on_tick(now):
                if isinstance(effect, Send):
                    for told in other.on_message(effect.payload, now, "r"):
                        if isinstance(told, DuplicateId):
                            found.setdefault("new" if other is new else "old", []).append(told)
    assert [(d.own_boot_id, d.other_boot_id, d.am_newcomer) for d in found["old"]] == [(5, 9, False)]
    assert [(d.own_boot_id, d.other_boot_id, d.am_newcomer) for d in found["new"]] == [(9, 5, True)]
    assert new.must_stop
    assert not old.must_stop


def test_a_late_echo_of_ones_own_past_is_no_twin():
    past, now_node = CommsNode("r", "team", 1, QUICK), CommsNode("r", "team", 2, QUICK)
    beacons = [e.payload for e in past.on_tick(0) + past.on_tick(SECOND) if isinstance(e, Send)]
    effects = [e for payload in beacons * 5 for e in now_node.on_message(payload, 10, "r")]
    assert not [e for e in effects if isinstance(e, DuplicateId)]


def test_a_twin_that_leaves_unheard_does_not_hide_the_robot_for_ever():
    listener = CommsNode("b", "team", 1, QUICK)
    robot, twin = CommsNode("a", "team", 5, QUICK), CommsNode("a", "team", 9, QUICK)
    seen: list[tuple[float, int]] = []

    def speak(node: CommsNode, now_ns: int) -> None:
        for effect in node.on_tick(now_ns):
            if isinstance(effect, Send):
                told = listener.on_message(effect.payload, now_ns, "a")
                seen.extend((now_ns / SECOND, e.boot_id) for e in told if isinstance(e, PeerSeen))

    listener.on_peer_joined("a", 0)
    for k in range(3):
        speak(robot, k * SECOND)
    speak(twin, 3 * SECOND)
    assert [boot for _, boot in seen] == [9]
    for k in range(3, 40):
        speak(robot, k * SECOND)
    (back,) = seen[1:]
    assert back[1] == 5 and back[0] > 3 + QUICK.peer_timeout_s


def test_a_goodbye_is_not_taken_for_a_loss():
    team = Team("ab", link=LinkConditions(delay_s=0.2, jitter_s=0.2))
    team.run(2)
    for effect in team.nodes["a"].leave():
        team.ends["a"].send(effect)
    team.ends["a"].close()
    del team.nodes["a"]
    team.run(2)
    assert [event.reason for event in team.of(PeerGone, "b")] == ["left"]


def test_who_is_here_and_who_is_gone():
    team = Team("abc")
    team.run(2)
    assert sorted(e.peer for e in team.of(PeerSeen, "a")) == ["b", "c"]
    team.ends["b"].close()
    del team.nodes["b"]
    t0 = team.now_ns
    team.run(1)
    gone = [t for t, who, e in team.events if who == "a" and isinstance(e, PeerGone)]
    assert gone
    assert gone[0] - t0 <= SECOND // 2  # a clean departure is seen at once
    team.crash("c")
    t0 = team.now_ns
    team.run(6)
    gone = [t for t, who, e in team.events if who == "a" and isinstance(e, PeerGone)]
    assert gone[-1] - t0 <= 3 * SECOND


def test_bad_names_and_modes_are_refused():
    with pytest.raises(InputError, match="robot id must be"):
        CommsNode("a/b", "team", 1)
    with pytest.raises(InputError, match="mode must be one of"):
        CommsNode("a", "team", 1, mode="boss")


def test_a_beacon_that_comes_late_or_twice_tells_nothing():
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    beacons = []
    for k in range(3):
        now_ns = 10 * k * SECOND
        a.set_own_pose(np.array([float(k), 0.0, 0.0]), now_ns)
        a.add_claims([("b", np.array([float(k), 0.0, 0.0]), 1.0, 1)])
        beacons.append(beacon_at(a, now_ns))
    heard = [effect for k in (0, 2, 1, 2) for effect in b.on_message(beacons[k], 30 * SECOND, "a")]
    assert [e.T_map_base[0] for e in heard if isinstance(e, TeammatePose)] == [0.0, 2.0]
    assert [e.T_peer_robot[0] for e in heard if isinstance(e, TeammateClaim)] == [0.0, 2.0]


def test_a_robot_is_no_teammate_of_its_own():
    assert not CommsNode("a", "team", 1, QUICK).on_peer_joined("a", 0)


def test_a_robot_that_is_heard_again_is_not_gone():
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    late = round(0.7 * QUICK.peer_timeout_s * SECOND)
    for now_ns in (0, late):
        b.on_message(beacon_at(a, now_ns), now_ns, "a")
    assert not [e for e in b.on_tick(late + late) if isinstance(e, PeerGone)]
    assert [e for e in b.on_tick(late + 2 * late) if isinstance(e, PeerGone)]


@pytest.mark.parametrize("has_token", [True, False])
def test_a_silent_robot_is_gone_unless_its_token_is_up(has_token: bool):
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    if has_token:
        b.on_peer_joined("a", 0)
    b.on_message(beacon_at(a, 0), 0, "a")
    effects = b.on_tick(round(QUICK.peer_timeout_s * SECOND) + 1)
    assert [e.peer for e in effects if isinstance(e, PeerGone)] == ([] if has_token else ["a"])


@pytest.mark.parametrize(("boot", "is_gone"), [(1, False), (2, True)])
def test_the_goodbye_of_an_earlier_life_that_comes_late_parts_nobody(boot: int, is_gone: bool):
    b = CommsNode("b", "team", 1, QUICK)
    b.on_message(beacon_at(CommsNode("a", "team", 2, QUICK), 0), 0, "a")
    effects = b.on_message(encode(Bye("a", boot), TAG), SECOND, "a")
    assert bool([e for e in effects if isinstance(e, PeerGone)]) == is_gone


def test_a_link_quality_given_before_the_robot_is_in_sight_holds_from_then_on():
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    assert b.set_link_quality("a", 0.9, 0) == []
    effects = b.on_message(beacon_at(a, 0), 0, "a")
    assert [(e.peer, e.quality, e.state) for e in effects if isinstance(e, LinkChanged)] == [("a", 0.9, 1)]


def test_tokens_put_no_more_robots_in_sight_than_there_may_be() -> None:
    node = CommsNode("a", "team", 1, replace(QUICK, max_robots=2))
    for k in range(5):
        node.on_peer_joined(f"r{k}", 0)
    node.on_peer_joined("r0", 0)
    assert sorted(node.peers) == ["r0", "r1"] and node.dropped["too many robots"] == 3


@pytest.mark.parametrize("name", ["a b", "b\n", "x" * 65, ".b"])
def test_a_token_of_a_name_that_no_robot_can_have_is_not_heard(name: str) -> None:
    node = CommsNode("a", "team", 1, QUICK)
    assert node.on_peer_joined(name, 0) == [] and not node.peers


def test_the_watch_for_twins_does_not_grow_with_their_boots() -> None:
    node, watch = CommsNode("a", "team", 1, QUICK), DuplicateIdWatch()
    beacon = decode(beacon_at(node, 0), TAG, 1000)
    for boot in range(3 * MOST_BOOTS):
        watch.hear(replace_fields(beacon, boot=boot))
    assert len(watch._seen) <= MOST_BOOTS + 1


def test_beacons_say_nothing_of_the_link_to_who_is_gone() -> None:
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    b.on_message(beacon_at(a, 0), 0, "a")
    first, _, last = (decode(beacon_at(b, k * SECOND), TAG, 1000) for k in (0, 10, 20))  # a is gone in the second tick
    assert [peer for peer, _ in first.heard] == ["a"] and last.heard == []


def test_a_robot_whose_token_is_up_stays_though_it_restarted_and_is_silent() -> None:
    b = CommsNode("b", "team", 1, QUICK)
    b.on_peer_joined("a", 0)
    for boot in (1, 2):
        b.on_message(beacon_at(CommsNode("a", "team", boot, QUICK), 0), 0, "a")
    assert not [e for e in b.on_tick(round(QUICK.peer_timeout_s * SECOND) + 1) if isinstance(e, PeerGone)]
    assert list(b.peers) == ["a"]


def test_of_two_processes_that_began_at_once_the_one_with_the_greater_boot_id_stops() -> None:
    beacons = {boot: decode(beacon_at(CommsNode("r", "team", boot, QUICK), 0), TAG, 1000) for boot in (5, 9)}
    assert not am_newcomer(0, 5, beacons[9])
    assert am_newcomer(0, 9, beacons[5])


def test_a_link_quality_that_is_no_number_is_no_link() -> None:
    a, b = CommsNode("a", "team", 1, QUICK), CommsNode("b", "team", 1, QUICK)
    b.on_message(beacon_at(a, 0), 0, "a")
    for given, quality in ((0.9, 0.9), (float("nan"), 0.0), (7.0, 1.0)):
        b.set_link_quality("a", given, 0)
        assert b.rendezvous.peers["a"].quality == quality


def test_only_who_says_that_it_merges_is_taken_for_one_that_searches():
    node = CommsNode("a", "team", 1, QUICK, seed=1)
    node.on_peer_joined("b", 0)  # a token tells no mode
    assert set(node.peers) == {"b"} and node.searching == set()
    for mode, searching in ((MODES.index("mapper"), set()), (MODES.index("distributed"), {"b"})):
        beacon = Beacon("b", 5, mode + 1, 0, 500, mode, [], 0, None)
        node.on_message(encode(beacon, TAG), 0, "b")
        assert node.searching == searching
