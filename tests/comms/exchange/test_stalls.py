"""Exchanges that could stand still, go round in circles, or be crowded out: none does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from mrslam.comms import CommsConfig, CommsNode, ExchangeDone, ExchangeFailed, ExchangeStarted, LinkConditions
from mrslam.comms.exchange.in_flight import InFlight
from mrslam.comms.maps.chunks import content_hash, make_chunks
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.store import NOTHING, MapStore
from mrslam.comms.wire.bitmask import to_mask
from mrslam.comms.wire.frames import team_tag
from mrslam.comms.wire.messages import HOLD_ALL, Beacon, Chunk, Done, Manifest, Open, encode
from mrslam.comms.wire.tile_codec import compress, pack_tiles, unknown_tile
from mrslam.spatial import Keyframes, LocalMap, OccupancyGrid, Tile, TiledMap
from tests.comms.puppet import BOOT, Puppet
from tests.comms.team import QUICK, SECOND, Team, big_map, fingerprint

PATIENCE_NS = 4 * SECOND


def noisy_map() -> LocalMap:
    """Return one that takes 180 kB on the wire."""
    rng = np.random.default_rng(0)
    cells = big_map(1500).map.to_grid().cells.copy()
    noisy = rng.random(cells.shape) < 0.1
    cells[noisy] = rng.choice(np.array([0, 30, 70, 100], dtype=np.int8), noisy.sum())
    return LocalMap(TiledMap.from_grid(OccupancyGrid(cells, 0.05), 1), big_map().keyframes)


def row_of_tiles(count: int, revision: int, before: TiledMap | None = None) -> LocalMap:
    rng = np.random.default_rng(0)
    tiles = {} if before is None else dict(before.tiles)
    for col in range(count):
        cells = rng.choice(np.array([-1, 0, 100], dtype=np.int8), (64, 64))
        tiles.setdefault((0, col), Tile(revision, cells))
    return LocalMap(TiledMap(0.05, tiles, revision), Keyframes.empty())


def by_lane(team: Team, link: Callable[[str], LinkConditions]) -> None:
    """Give each lane a link and a queue of its own, as a real network does: control goes before bulk."""
    lanes: dict = {}
    network = team.network
    network._queue_s = 1e9
    carry = network._carry_one

    def carry_one(sender, name, receiver, effect):
        saved = network._free_ns, network._last_ns
        network._free_ns, network._last_ns = lanes.setdefault(effect.lane, ({}, {}))
        team.link = link(effect.lane)
        carry(sender, name, receiver, effect)
        network._free_ns, network._last_ns = saved

    network._carry_one = carry_one


def test_what_is_on_its_way_is_not_sent_again():
    flow = InFlight(0)
    assert flow.due([0, 1, 2], 0, PATIENCE_NS) == [0, 1, 2]
    assert flow.due([0, 1, 2], SECOND, PATIENCE_NS) == []
    assert flow.due([1, 2, 3], 2 * SECOND, PATIENCE_NS) == [3]  # the first is there, another is asked for
    assert flow.due([1, 2, 3], 5 * SECOND, PATIENCE_NS) == []


def test_what_was_overtaken_is_lost_and_so_is_all_where_nothing_arrives():
    flow = InFlight(0)
    flow.due([0, 1, 2], 0, PATIENCE_NS)
    assert flow.due([0, 2], SECOND, PATIENCE_NS) == [0]
    assert flow.due([0, 2], 2 * SECOND, PATIENCE_NS) == []
    assert flow.due([0, 2], 5 * SECOND, PATIENCE_NS) == [0, 2]
    assert flow.due([0, 2], 6 * SECOND, PATIENCE_NS) == []


@pytest.mark.parametrize("kbit_per_s", [64, 150])
def test_a_slow_link_carries_a_map_once(kbit_per_s):
    team = Team("ab", config=CommsConfig(link_source="model"), step_ns=SECOND // 10)
    slow = LinkConditions(delay_s=0.02, rate_bps=1e3 * kbit_per_s)
    by_lane(team, lambda lane: slow if lane == "bulk" else LinkConditions(delay_s=0.02))
    team.nodes["a"].publish(noisy_map(), 0)
    assert team.run_until(lambda: "a" in team.nodes["b"].store.maps, 40)
    assert team.nodes["a"].bytes_sent["bulk"] < 190_000
    assert not team.of(ExchangeFailed)


def test_an_exchange_that_is_over_for_the_peer_begins_anew_where_more_is_wanted():
    """Robot a takes c's map from c while it gives its own to b, who holds c's, too; c goes before it is done."""
    slow = {frozenset("ac"): 20e3, frozenset("ab"): 60e3}
    team = Team("abc", config=CommsConfig(link_source="model"), step_ns=SECOND // 20)

    def conditions(one, other, now_ns):
        if team.groups.get(one, 0) != team.groups.get(other, 0):
            return LinkConditions(loss=1.0)
        rate = slow.get(frozenset((one, other))) if "a" in team.nodes["a"].store.maps else None
        return LinkConditions(delay_s=0.05, **({} if rate is None else {"rate_bps": rate}))

    team.network.conditions = conditions
    team.network._queue_s = 1e9
    a = team.nodes["a"]
    team.groups = {"a": 1}
    team.nodes["c"].publish(big_map(1000, seed=3), 0)
    assert team.run_until(lambda: "c" in team.nodes["b"].store.maps)
    a.publish(big_map(2500, seed=4), team.now_ns)
    team.groups = {"b": 2, "a": 1, "c": 1}
    assert team.run_until(lambda: "c" in a.staged_maps.staging)
    team.groups = {}
    assert team.run_until(lambda: (open_now := a._exchanges.active.get("b")) is not None and open_now.is_done, 20)
    team.groups = {"c": 3}
    assert team.run_until(lambda: "c" in a.store.maps, 15)


@pytest.mark.parametrize("first", [15, None])
def test_a_map_beyond_the_takers_bounds_is_refused_at_once(first):
    team = Team("ab", config=replace(QUICK, max_tiles=20))
    before = None
    if first is not None:
        local = row_of_tiles(first, 1)
        before = local.map
        team.nodes["a"].publish(local, 0)
        assert team.run_until(lambda: "a" in team.nodes["b"].store.maps)
        team.run(4)
    team.nodes["a"].publish(row_of_tiles(25, 2, before), team.now_ns)
    sent, told = team.nodes["a"].bytes_sent["bulk"], len(team.events)
    team.run(60)
    assert team.nodes["a"].bytes_sent["bulk"] == sent
    ended = [event for _, _, event in team.events[told:] if isinstance(event, ExchangeDone | ExchangeFailed)]
    assert len(ended) > 10 and all(event.reason == "complete" and event.costs.seconds < 3 for event in ended)
    assert team.nodes["b"].dropped["bad manifest"] > 0


def test_a_stranger_that_begins_maps_without_end_is_bounded_and_shuts_nobody_out():
    team = Team("ab", config=replace(QUICK, max_robots=8))
    for robot in "ab":
        team.publish(robot)
    assert team.run_until_agreed(10)
    victim, tag = team.nodes["a"], team_tag("team")
    for message in (Beacon("evil", 1, 1, 1000, 1000, 0, [], 0, None), Open("evil", 1, 7, [], [])):
        victim.on_message(encode(message, tag), team.now_ns, "evil")
        victim.set_link_quality("evil", 1.0, team.now_ns)
    cells = np.zeros((1, 64, 64), dtype=np.int8)
    raw = pack_tiles(cells, unknown_tile()[None])
    for number in range(100):
        name = f"{number:064d}"
        manifest = Manifest("evil", 7, name, 1, 0, 1, 0.05, 0, [], [], [0, 9], [0, 9], [0, 0])
        checked = content_hash(manifest, [], [0], cells)
        chunk = Chunk("evil", 7, name, 1, 0, 1, to_mask([0]), False, len(raw), compress(raw), checked)
        for message in (manifest, chunk):
            victim.on_message(encode(message, tag), team.now_ns, "evil")
    assert 0 < len(victim.staged_maps.staging) <= 6
    victim.on_peer_left("evil", team.now_ns)
    for robot in "ab":
        team.publish(robot)
    assert team.run_until_agreed(20)


def test_a_manifest_that_brings_nothing_keeps_no_map_from_being_taken_elsewhere():
    """A team without keys: c makes up a newer map of a, again and again, and never sends a chunk of it."""
    team = Team("abc")
    team.run(3)
    b = team.nodes["b"]
    del team.nodes["c"]  # it is here, and says no more than what follows
    team.groups = {"a": 1}
    team.step()

    def lie(k: int) -> None:
        for message in (
            Open("c", 3, k // 8, [("a", 50, 9)], []),
            Manifest("c", k // 8, "a", 50, 0, 9, 0.05, 0, [], [], [0], [0], [0]),
        ):
            b.on_message(encode(message, b.team_tag), team.now_ns, "c")

    team.publish("a")
    for k in range(8 * 60):
        lie(k)
        team.step()
        if k == 40:
            team.groups = {}
    assert "a" in b.store.maps


def test_an_exchange_in_which_messages_bring_nothing_ends():
    team = Team("ab")
    assert team.run_until(lambda: bool(team.of(ExchangeDone, "b")))
    b = team.nodes["b"]
    del team.nodes["a"]  # it is here, and says no more than what follows
    begun_ns = team.now_ns
    b.on_message(encode(Open("a", 3, 7, [("x", 50, 9)], []), b.team_tag), team.now_ns, "a")
    offer = encode(Manifest("a", 7, "x", 50, 0, 9, 0.05, 0, [], [], [0], [0], [0]), b.team_tag)

    def failed() -> list[tuple[int, str]]:
        return [(t, e.reason) for t, who, e in team.events if who == "b" and isinstance(e, ExchangeFailed)]

    while not failed() and team.now_ns < begun_ns + 60 * SECOND:
        b.on_message(offer, team.now_ns, "a")
        team.step()
    ((ended_ns, reason),) = failed()
    assert reason == "no progress" and ended_ns - begun_ns <= 4 * PATIENCE_NS + SECOND


def test_every_exchange_that_began_has_one_end_and_none_ends_that_did_not_begin():
    team = Team("abc", link=LinkConditions(loss=0.3), reliable=False)
    for k in range(60):
        team.publish("abc"[k % 3])
        team.groups = {"c": 1} if k % 7 == 3 else {}
        team.run(1)
    team.groups = {"a": 1, "b": 2}
    team.run(30)
    begun, ended = ({}, {})
    for _, who, event in team.events:
        if isinstance(event, ExchangeStarted):
            begun[who, event.peer] = begun.get((who, event.peer), 0) + 1
        if isinstance(event, ExchangeDone | ExchangeFailed):
            ended[who, event.peer] = ended.get((who, event.peer), 0) + 1
            assert ended[who, event.peer] <= begun.get((who, event.peer), 0)
    assert begun == ended and sum(begun.values()) > 20


def test_the_end_of_a_budget_does_not_overtake_its_last_chunk():
    team = Team("ab", config=replace(QUICK, exchange_budget_bytes=2000, chunk_bytes=1000, window_tiles=200))
    by_lane(team, lambda lane: LinkConditions(delay_s=0.3 if lane == "bulk" else 0.0))
    team.nodes["a"].publish(big_map(), 0)
    assert team.run_until(lambda: "a" in team.nodes["b"].store.maps, 60)
    assert "budget spent" in [event.reason for event in team.of(ExchangeDone)]


def test_a_mapper_opens_to_who_takes_maps_though_other_mappers_have_waited_longer():
    team = Team(["m1", "m2", "m3", "z"], modes={"m1": "mapper", "m2": "mapper", "m3": "mapper", "z": "central"})
    for robot in ("m1", "m2", "m3"):
        team.publish(robot)
    team.run(20)
    opened = [who for _, who, event in team.events if isinstance(event, ExchangeStarted) and event.opened_by_me]
    assert {"m1", "m2", "m3"} <= set(opened)


def test_who_brings_an_item_now_and_then_keeps_nobody_from_the_robot_itself() -> None:
    node = CommsNode("a", "team", 1, QUICK)
    store = MapStore("c", 50, QUICK)
    store.publish(big_map(400))
    slow, robot = Puppet(node, "b"), Puppet(node, "c")
    slow.meet(("c", 50, 1))
    slow.bring(store, "c", most=1)
    assert node.store.version("c") == NOTHING and node.staged_maps.staging
    robot.meet(("c", 50, 1))
    robot.bring(store, "c")
    assert node.store.version("c") == (50, 1)


def test_an_exchange_in_which_a_map_was_refused_is_done_at_once() -> None:
    node = CommsNode("a", "team", 1, QUICK)
    liar = Puppet(node, "b")
    liar.meet(("c", 50, 9))
    done = liar.say(Manifest("b", liar.xid, "c", 50, 0, 9, 0.05, 0, [], [], [0], [0], [99]))
    assert node.dropped["bad manifest"] == 1
    assert [message.code for message in done if isinstance(message, Done)] == [HOLD_ALL]


@pytest.mark.parametrize("silent_s", [0.0, 1.1 * QUICK.retry_s])
def test_who_lets_a_manifest_pass_without_an_item_keeps_nobody_from_bringing_the_map(silent_s: float) -> None:
    node = CommsNode("a", "team", 1, QUICK)
    store = MapStore("c", 50, QUICK)
    store.publish(big_map(400))
    liar, third = Puppet(node, "b"), Puppet(node, "d")
    liar.meet(("c", 50, 9))
    liar.say(Manifest("b", liar.xid, "c", 50, 0, 9, 0.05, 0, [], [], [0], [0], [0]))
    third.meet(("c", 50, 1))
    node.on_tick(round(silent_s * SECOND))
    third.bring(store, "c")
    assert (node.store.version("c") == (50, 1)) == (silent_s > 0.0)


def test_chunks_of_a_manifest_that_was_replaced_are_passed_over() -> None:
    node, b = CommsNode("a", "team", 1, replace(QUICK, window_tiles=64)), MapStore("b", BOOT, QUICK)
    puppet = Puppet(node, "b")
    b.publish(row_of_tiles(2, 1))
    puppet.meet(("b", BOOT, 1))
    old = make_manifest(b, "b", puppet.xid, "b", NOTHING, None)
    b.publish(row_of_tiles(3, 2))
    new = make_manifest(b, "b", puppet.xid, "b", NOTHING, None)
    assert old is not None and new is not None
    for manifest in (old, new):
        puppet.say(manifest)
    for chunk in (*make_chunks(b, old, [0, 1], QUICK), *make_chunks(b, new, [0, 1, 2], QUICK)):
        puppet.say(chunk)
    assert not node.dropped
    assert fingerprint(node.store.maps["b"]) == fingerprint(b.maps["b"])
