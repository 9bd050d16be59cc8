from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from comms import (
    CommsNode,
    Dropped,
    DuplicateId,
    ExchangeDone,
    ExchangeFailed,
    ExchangeStarted,
    Incoming,
    LinkChanged,
    LinkConditions,
    MapUpdated,
    PeerGone,
    PeerSeen,
    Send,
    TeammatePose,
)
from comms import messages as m
from comms.frames import team_tag
from spatial import InputError, LocalMap, Tile, TiledMap
from tests.comms.team import QUICK, SECOND, Team, big_map, fingerprint

TAG = team_tag("team")


def _replace(settings):
    return replace(QUICK, **settings)


def test_two_robots_hold_each_others_maps():
    team = Team("ab")
    for robot in "ab":
        team.publish(robot)
    assert team.run_until_agreed(5)
    for robot in "ab":
        held = [fingerprint(node.store.maps[robot]) for node in team.nodes.values()]
        assert held[0] == held[1]
    assert len(team.of(ExchangeStarted)) == 2


def test_a_map_travels_through_a_third_robot_and_is_the_same():
    team = Team("abc")
    team.publish("a")
    team.groups = {"c": 1}
    team.run(6)
    assert "a" not in team.nodes["c"].store.maps
    team.groups = {"a": 2}
    team.run(6)
    updates = [event for event in team.of(MapUpdated, "c") if event.robot_id == "a"]
    assert [event.source for event in updates] == ["b"]
    assert fingerprint(team.nodes["c"].store.maps["a"]) == fingerprint(team.nodes["a"].store.maps["a"])


def test_only_what_changed_travels_again():
    team = Team("ab", config=_replace({"window_tiles": 128}))
    first = big_map()
    team.nodes["a"].publish(first, 0)
    assert team.run_until_agreed(10)
    team.run(1)
    cost = team.of(ExchangeDone, "a")[-1].bytes_sent
    tiles = dict(first.map.tiles)
    cells = tiles[3, 3].cells.copy()
    cells[5, 5:9] = 75
    tiles[3, 3] = Tile(2, cells)
    team.nodes["a"].publish(LocalMap(TiledMap(0.05, tiles, 2), first.keyframes), team.now_ns)
    assert team.run_until_agreed(10)
    team.run(1)
    update = team.of(MapUpdated, "b")[-1]
    assert update.changed == ((3, 3),)
    again = team.of(ExchangeDone, "a")[-1]
    assert again.bytes_sent < 250 < cost
    assert again.bytes_full_raw > 500_000
    assert 100 * again.bytes_sent < again.bytes_full_lz4 < again.bytes_full_raw / 10


def test_a_repeat_with_nothing_new_costs_less_than_a_kilobyte():
    team = Team("ab", config=_replace({"window_tiles": 128}))
    team.nodes["a"].publish(big_map(), 0)
    team.run(20)
    last = team.of(ExchangeDone, "a")[-1]
    assert last.tiles == 0
    assert last.bytes_sent + last.bytes_received < 200
    assert last.reason == "complete"


def test_threshold_and_timeout_decide_when_robots_meet():
    team = Team("ab", config=_replace({"exchange_timeout_s": 7.0, "link_source": "measured", "link_threshold": 0.8}))
    team.run(40)
    times = [t for t, who, effect in team.events if isinstance(effect, ExchangeDone) and who == "a"]
    gaps = np.diff(times) / SECOND
    assert len(times) >= 4
    assert (gaps >= 7.0).all()
    assert (gaps <= 8.5).all()
    poor = Team("ab", config=_replace({"link_source": "measured"}), link=LinkConditions(loss=0.4))
    poor.run(60)
    assert not poor.of(ExchangeStarted)
    assert poor.of(LinkChanged)
    low = Team(
        "ab", config=_replace({"link_source": "measured", "link_threshold": 0.15}), link=LinkConditions(loss=0.4)
    )
    low.run(60)
    assert low.of(ExchangeDone)


def test_a_broken_exchange_goes_on_where_it_stopped():
    team = Team("ab", config=_replace({"window_tiles": 16}), link=LinkConditions(delay_s=0.2))
    team.nodes["a"].publish(big_map(), 0)
    while len(team.nodes["b"].store.staging.get("a", _NOTHING).tiles) < 60:
        team.step()
    assert "a" not in team.nodes["b"].store.maps  # never half of one
    before = len(team.nodes["b"].store.staging["a"].tiles)
    team.groups = {"b": 1}
    team.run(8)
    assert team.of(ExchangeFailed, "b")
    assert len(team.nodes["b"].store.staging["a"].tiles) >= before
    team.groups = {}
    assert team.run_until_agreed(60)
    total = len(team.nodes["a"].store.maps["a"].map.tiles)
    assert team.of(ExchangeDone, "b")[-1].tiles <= total - before


class _Nothing:
    tiles: dict = {}  # noqa: RUF012


_NOTHING = _Nothing()


def test_a_broken_exchange_goes_on_with_another_robot_and_a_newer_map():
    team = Team("abc", config=_replace({"window_tiles": 16}), link=LinkConditions(delay_s=0.2))
    first = big_map()
    team.groups = {"c": 1}
    team.nodes["a"].publish(first, 0)
    assert _run_until(team, lambda: "a" in team.nodes["b"].store.maps)
    team.groups = {"b": 1}
    assert _run_until(team, lambda: len(team.nodes["c"].store.staging.get("a", _NOTHING).tiles) >= 60)
    staged = len(team.nodes["c"].store.staging["a"].tiles)
    team.groups = {"a": 1}
    assert _run_until(team, lambda: "a" in team.nodes["c"].store.maps)
    done = [event for event in team.of(ExchangeDone, "c") if event.peer == "b"][-1]
    assert done.tiles <= len(first.map.tiles) - staged + 16


def _run_until(team: Team, condition, limit_s: float = 60.0) -> bool:
    end = team.now_ns + limit_s * SECOND
    while not condition() and team.now_ns < end:
        team.step()
    return condition()


def test_a_budget_brings_the_most_valuable_tiles_first_and_the_rest_later():
    team = Team("ab", config=_replace({"exchange_budget_bytes": 2000, "chunk_bytes": 1000, "window_tiles": 200}))
    team.nodes["a"].publish(big_map(), 0)
    assert _run_until(team, lambda: bool(team.of(ExchangeDone, "b")))
    first = team.of(ExchangeDone, "b")[0]
    assert first.reason == "budget spent"
    assert 0 < first.bytes_received < 4000
    staged = team.nodes["b"].store.staging["a"].tiles
    whole = team.nodes["a"].store.maps["a"].map.tiles

    def known(tiles) -> float:
        return float(np.mean([np.count_nonzero(tile.cells != -1) for tile in tiles]))

    assert known(staged.values()) > known(tile for index, tile in whole.items() if index not in staged)
    # The map goes on changing faster than the budget brings it: still a whole snapshot arrives.
    for k in range(2, 40):
        team.nodes["a"].publish(big_map(seed=k, revision=k), team.now_ns)
        team.run(3)
    assert team.of(MapUpdated, "b")


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
    assert _run_until(team, lambda: b.version("a") == a.version("a"), 20)
    old = a.version("a")
    team.nodes["a"].begin_map()
    team.nodes["a"].begin_map()  # said twice, it is still one
    assert a.version("a") == old
    team.nodes["a"].publish(big_map(400, seed=1, revision=3), team.now_ns)
    assert a.version("a") == (old[0] + 1, 3)
    assert _run_until(team, lambda: b.version("a") == a.version("a"), 20)
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
    assert _run_until(team, lambda: "b" in team.nodes["a"].store.maps, 15)


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
    assert max(e.bytes_received for e in team.of(ExchangeDone, "m1")) < 250


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


def test_where_a_teammate_is_arrives_with_its_age_not_its_clock():
    team = Team("ab", config=_replace({"beacon_period_s": 0.25}))
    team.run(2)
    team.nodes["a"].set_own_pose(np.array([1.2345, -2.0, 0.5]), team.now_ns - SECOND // 2)
    team.step()
    team.step()
    seen = team.of(TeammatePose, "b")[-1]
    assert seen.peer == "a"
    assert seen.T_map_base == pytest.approx([1.2345, -2.0, 0.5], abs=6e-4)
    assert abs(seen.stamp_ns - (team.now_ns - SECOND // 2)) < 0.6 * SECOND
    count = len(team.of(TeammatePose, "b"))
    team.run(3)
    assert len(team.of(TeammatePose, "b")) == count  # the same pose is told once


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


def test_bad_input_is_counted_told_now_and_then_and_changes_nothing():
    node = CommsNode("a", "team", 1, QUICK)
    node.publish(big_map(200), 0)
    before = node.store.digest()
    told = []
    for k in range(100):
        told += node.on_message(b"rubbish" * k, 0, "b")
    assert [e.count for e in told if isinstance(e, Dropped) and e.kind == "foreign protocol"] == [
        1,
        2,
        4,
        8,
        16,
        32,
        64,
    ]
    assert node.dropped["truncated"] == 2
    assert node.store.digest() == before
    assert not node.peers


def test_a_message_under_anothers_name_is_dropped():
    node = CommsNode("a", "team", 1, QUICK)
    told = node.on_message(m.encode(m.Bye("b", 1), TAG), 0, "c")
    assert [(e.kind, e.sender) for e in told] == [("misattributed", "c")]


def test_another_team_is_not_heard():
    node = CommsNode("a", "team", 1, QUICK)
    other = CommsNode("b", "rivals", 1, QUICK)
    for effect in other.on_tick(0):
        if isinstance(effect, Send):
            node.on_message(effect.payload, 0, "b")
    assert node.dropped == {"foreign team": 1}
    assert not node.peers


def test_a_chunk_that_lies_about_its_content_is_refused():
    team = Team("ab", config=_replace({"window_tiles": 1}))
    team.nodes["a"].publish(big_map(200), 0)
    refused = 0
    original = team.nodes["b"].on_message

    def tampered(payload, now_ns, sender=None):
        nonlocal refused
        message = m.decode(payload, TAG, 1 << 20)
        if isinstance(message, m.Chunk) and refused < 3:
            refused += 1
            payload = m.encode(msgspec.structs.replace(message, content_hash=b"x" * 8), TAG)
        return original(payload, now_ns, sender)

    team.nodes["b"].on_message = tampered
    assert team.run_until_agreed(30)
    assert team.nodes["b"].dropped["bad hash"] == 3


@pytest.mark.parametrize(
    "change",
    [
        {"target": 0},
        {"ages": [0]},
        {"rows": [0, 0], "cols": [0, 0], "ages": [0, 0]},
        {"ages": [99, 0]},
        {"blocks": [1], "block_ages": [0]},
        {"blocks": [0, 0], "block_ages": [0, 0]},
        {"keyframes": 2**40},
    ],
)
def test_manifests_that_contradict_themselves_are_refused(change):
    from comms.exchange import check_manifest
    from comms.frames import WireError

    good = m.Manifest("b", 1, "b", 1, 0, 5, 0.05, 10, [0], [0], [0, 1], [0, 0], [0, 1])
    check_manifest(good, QUICK)
    with pytest.raises(WireError, match="bad manifest"):
        check_manifest(msgspec.structs.replace(good, **change), QUICK)


def test_a_map_too_wide_for_any_memory_is_refused():
    from comms.exchange import check_extent
    from comms.frames import WireError
    from comms.snapshots import Snapshot

    near = m.Manifest("b", 1, "b", 1, 0, 5, 0.05, 10, [0], [0], [0, 100], [0, 100], [0, 1])
    cells = np.zeros((64, 64), dtype=np.int8)
    check_extent(near, Snapshot(1, TiledMap(0.05), ()))
    for far, base in (
        (msgspec.structs.replace(near, rows=[0, 2**19], cols=[0, 2**19]), {}),
        (near, {(2**19, -(2**19)): Tile(1, cells)}),
    ):
        with pytest.raises(WireError, match="too wide"):
            check_extent(far, Snapshot(1, TiledMap(0.05, base), ()))


def test_bad_names_and_modes_are_refused():
    with pytest.raises(InputError, match="robot id must be"):
        CommsNode("a/b", "team", 1)
    with pytest.raises(InputError, match="mode must be one of"):
        CommsNode("a", "team", 1, mode="boss")


def test_one_seed_gives_the_same_bytes():
    def run(seed: int) -> list[bytes]:
        sent = []
        team = Team("abc", seed=seed, link=LinkConditions(loss=0.2, jitter_s=0.5), reliable=False)
        for robot in "abc":
            team.publish(robot)
            end = team.ends[robot]
            end.send = lambda effect, send=end.send: (sent.append(effect.payload), send(effect))[1]
        team.run(20)
        return sent

    assert run(4) == run(4)
    assert run(4) != run(5)


def test_beacon_traffic_is_linear_in_peers():
    def beacon_bytes(count: int) -> float:
        team = Team(
            [f"r{k:03d}" for k in range(count)], config=_replace({"exchange_timeout_s": 1e6, "link_threshold": 1.0})
        )
        team.link = LinkConditions()
        team.run(6)
        return sum(node.bytes_sent["beacon"] for node in team.nodes.values()) / count

    few, many = beacon_bytes(20), beacon_bytes(60)
    assert many < 1.15 * few


def test_messages_of_an_exchange_may_come_from_nowhere():
    node = CommsNode("a", "team", 1, QUICK)
    for message in (
        m.Accept("b", 1, 7, [], []),
        m.Ask("b", 7, "a", 1, 0),
        m.Get("b", 7, "a", 1, 0, 1, b"\1"),
        m.Done("b", 7, 0),
        m.Refuse("b", 7, "no"),
        m.Chunk("b", 7, "a", 1, 0, 1, b"\1", False, 1, b"x", b"12345678"),
    ):
        for effect in node.on_message(m.encode(message, TAG), 0, "b"):
            assert isinstance(m.decode(effect.payload, TAG, 1 << 20), m.Refuse)
    assert isinstance(Incoming(b"", None, "bulk"), Incoming)


def test_late_ends_of_an_exchange_do_not_echo_for_ever():
    team = Team("ab", link=LinkConditions(duplicate=0.9, delay_s=0.6), reliable=False)
    team.publish("a")
    team.run(30)
    assert sum(node.bytes_sent["control"] for node in team.nodes.values()) < 60_000
