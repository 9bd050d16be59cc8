"""Exchanges: who gets what from whom, and what it costs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mrslam.comms import ExchangeDone, ExchangeFailed, ExchangeStarted, LinkChanged, LinkConditions, MapUpdated
from mrslam.comms.wire.frames import team_tag
from mrslam.spatial import LocalMap, Tile, TiledMap
from tests.comms.team import QUICK, SECOND, Team, big_map, fingerprint

TAG = team_tag("team")


def test_two_robots_hold_each_others_maps():
    team = Team("ab")
    for robot in "ab":
        team.publish(robot)
    assert team.run_until_agreed(5)
    for robot in "ab":
        held = [fingerprint(node.store.maps[robot]) for node in team.nodes.values()]
        assert held[0] == held[1]
    assert len(team.of(ExchangeStarted)) == 2


def test_what_a_robot_took_out_of_its_map_leaves_its_teammates_copies_too():
    team = Team("ab")
    first = big_map(400)
    gone = next(iter(first.map.tiles))
    team.nodes["a"].publish(first, 0)
    assert team.run_until_agreed(10)
    rest = {index: tile for index, tile in first.map.tiles.items() if index != gone}
    team.nodes["a"].publish(LocalMap(TiledMap(0.05, rest, 2), first.keyframes), team.now_ns)
    assert team.run_until_agreed(10)
    held = team.nodes["b"].store.maps["a"].map
    assert held.revision == 2 and (held.tiles[gone].cells == -1).all()


def test_of_two_proposals_that_cross_one_stands():
    team = Team("ab", link=LinkConditions(delay_s=0.3))  # longer than a step: both have opened before they hear
    for robot in "ab":
        team.publish(robot)
    assert team.run_until_agreed(10)
    assert {event.opened_by_me for event in team.of(ExchangeStarted)} == {True, False}
    assert not team.of(ExchangeFailed)


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
    team = Team("ab", config=replace(QUICK, window_tiles=128))
    first = big_map()
    team.nodes["a"].publish(first, 0)
    assert team.run_until_agreed(10)
    team.run(1)
    cost = team.of(ExchangeDone, "a")[-1].costs.bytes_sent
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
    assert again.costs.bytes_sent < 250 < cost
    assert again.costs.bytes_full_raw > 500_000
    assert 100 * again.costs.bytes_sent < again.costs.bytes_full_lz4 < again.costs.bytes_full_raw / 10


def test_a_repeat_with_nothing_new_costs_less_than_a_kilobyte():
    team = Team("ab", config=replace(QUICK, window_tiles=128))
    team.nodes["a"].publish(big_map(), 0)
    team.run(20)
    last = team.of(ExchangeDone, "a")[-1]
    assert last.costs.tiles == 0
    assert last.costs.bytes_sent + last.costs.bytes_received < 200
    assert last.reason == "complete"


def test_threshold_and_timeout_decide_when_robots_meet():
    team = Team("ab", config=replace(QUICK, exchange_timeout_s=7.0, link_source="measured", link_threshold=0.8))
    team.run(40)
    times = [t for t, who, effect in team.events if isinstance(effect, ExchangeDone) and who == "a"]
    gaps = np.diff(times) / SECOND
    assert len(times) >= 4
    assert (gaps >= 7.0).all()
    assert (gaps <= 8.5).all()
    poor = Team("ab", config=replace(QUICK, link_source="measured"), link=LinkConditions(loss=0.4))
    poor.run(60)
    assert not poor.of(ExchangeStarted)
    assert poor.of(LinkChanged)
    low = Team("ab", config=replace(QUICK, link_source="measured", link_threshold=0.15), link=LinkConditions(loss=0.4))
    low.run(60)
    assert low.of(ExchangeDone)


def test_a_broken_exchange_goes_on_where_it_stopped():
    team = Team("ab", config=replace(QUICK, window_tiles=16), link=LinkConditions(delay_s=0.2))
    team.nodes["a"].publish(big_map(), 0)
    while len(team.nodes["b"].staged_maps.staging.get("a", _NOTHING).tiles) < 60:
        team.step()
    assert "a" not in team.nodes["b"].store.maps  # never half of one
    before = len(team.nodes["b"].staged_maps.staging["a"].tiles)
    team.groups = {"b": 1}
    team.run(8)
    assert team.of(ExchangeFailed, "b")
    assert len(team.nodes["b"].staged_maps.staging["a"].tiles) >= before
    team.groups = {}
    assert team.run_until_agreed(60)
    total = len(team.nodes["a"].store.maps["a"].map.tiles)
    assert team.of(ExchangeDone, "b")[-1].costs.tiles <= total - before


class _Nothing:
    tiles: dict = {}  # noqa: RUF012


_NOTHING = _Nothing()


def test_a_broken_exchange_goes_on_with_another_robot_and_a_newer_map():
    team = Team("abc", config=replace(QUICK, window_tiles=16), link=LinkConditions(delay_s=0.2))
    first = big_map()
    team.groups = {"c": 1}
    team.nodes["a"].publish(first, 0)
    assert team.run_until(lambda: "a" in team.nodes["b"].store.maps)
    team.groups = {"b": 1}
    assert team.run_until(lambda: len(team.nodes["c"].staged_maps.staging.get("a", _NOTHING).tiles) >= 60)
    staged = len(team.nodes["c"].staged_maps.staging["a"].tiles)
    team.groups = {"a": 1}
    assert team.run_until(lambda: "a" in team.nodes["c"].store.maps)
    done = [event for event in team.of(ExchangeDone, "c") if event.peer == "b"][-1]
    assert done.costs.tiles <= len(first.map.tiles) - staged + 16


def test_an_exchange_goes_on_where_its_map_is_given_up_meanwhile():
    team = Team("ab", config=replace(QUICK, window_tiles=16), link=LinkConditions(delay_s=0.2))
    a, b = team.nodes["a"], team.nodes["b"].store
    a.publish(big_map(), 0)
    assert team.run_until(lambda: len(team.nodes["b"].staged_maps.staging.get("a", _NOTHING).tiles) >= 60)
    a.begin_map()
    a.publish(big_map(400, seed=1, revision=2), team.now_ns)
    assert team.run_until(lambda: b.version("a") == a.store.version("a"), 10)
    assert not team.of(ExchangeFailed)


def test_a_budget_brings_the_most_valuable_tiles_first_and_the_rest_later():
    team = Team("ab", config=replace(QUICK, exchange_budget_bytes=2000, chunk_bytes=1000, window_tiles=200))
    team.nodes["a"].publish(big_map(), 0)
    assert team.run_until(lambda: bool(team.of(ExchangeDone, "b")))
    first = team.of(ExchangeDone, "b")[0]
    assert first.reason == "budget spent"
    assert 0 < first.costs.bytes_received < 4000
    staged = team.nodes["b"].staged_maps.staging["a"].tiles
    whole = team.nodes["a"].store.maps["a"].map.tiles

    def known(tiles) -> float:
        return float(np.mean([np.count_nonzero(tile.cells != -1) for tile in tiles]))

    assert known(staged.values()) > known(tile for index, tile in whole.items() if index not in staged)
    # The map goes on changing faster than the budget brings it: still a whole snapshot arrives.
    for k in range(2, 40):
        team.nodes["a"].publish(big_map(seed=k, revision=k), team.now_ns)
        team.run(3)
    assert team.of(MapUpdated, "b")


def test_a_budget_below_the_size_of_a_chunk_brings_a_chunk_at_each_meeting():
    team = Team("ab", config=replace(QUICK, exchange_budget_bytes=1, chunk_bytes=1000, window_tiles=200))
    team.nodes["a"].publish(big_map(300), 0)
    assert team.run_until(lambda: bool(team.of(MapUpdated, "b")), 120)


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
            [f"r{k:03d}" for k in range(count)], config=replace(QUICK, exchange_timeout_s=1e6, link_threshold=1.0)
        )
        team.link = LinkConditions()
        team.run(6)
        return sum(node.bytes_sent["beacon"] for node in team.nodes.values()) / count

    few, many = beacon_bytes(20), beacon_bytes(60)
    assert many < 1.15 * few


def test_late_ends_of_an_exchange_do_not_echo_for_ever():
    team = Team("ab", link=LinkConditions(duplicate=0.9, delay_s=0.6), reliable=False)
    team.publish("a")
    team.run(30)
    assert sum(node.bytes_sent["control"] for node in team.nodes.values()) < 60_000


def test_an_exchange_ends_at_once_where_the_model_says_that_the_link_is_gone():
    team = Team("ab", link=LinkConditions(rate_bps=20_000))
    team.nodes["a"].publish(big_map(400), 0)
    team._record("a")
    assert team.run_until(lambda: bool(team.of(ExchangeStarted, "a")))
    effects = team.nodes["a"].set_link_quality("b", 0.0, team.now_ns)
    assert [(e.peer, e.reason) for e in effects if isinstance(e, ExchangeFailed)] == [("b", "link lost")]


def test_robots_say_in_exchanges_whose_maps_they_have_not_placed():
    team = Team("ab")
    team.publish("b")
    team.nodes["b"].set_unplaced([])
    assert team.run_until_agreed(5)
    assert not team.nodes["b"].placed_by["a"][0]  # it has not said
    assert not team.nodes["a"].placed_by["b"][0]  # it does not hold it
    team.publish("a")
    for unplaced, is_placed in (([], True), (["b"], False), (["c"], True)):
        before_ns = team.now_ns
        team.nodes["a"].set_unplaced(unplaced)
        team.publish("b")
        assert team.run_until_agreed(5)
        said, told_ns = team.nodes["b"].placed_by["a"]
        assert said is is_placed and before_ns < told_ns <= team.now_ns
        assert team.of(ExchangeStarted, "b")[-1].unplaced == tuple(unplaced)
