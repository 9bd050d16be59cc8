"""What a robot hears that no honest teammate says: counted, dropped, and nothing changed."""

from __future__ import annotations

from dataclasses import replace

import msgspec
import numpy as np
import pytest

from mrslam.comms import CommsNode, Dropped, Incoming, Send
from mrslam.comms.wire import messages as m
from mrslam.comms.wire.frames import team_tag
from mrslam.spatial import Tile, TiledMap
from tests.comms.team import QUICK, Team, big_map

TAG = team_tag("team")


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
    team = Team("ab", config=replace(QUICK, window_tiles=1))
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
    from mrslam.comms.maps.manifests import check_manifest
    from mrslam.comms.wire.frames import WireError

    good = m.Manifest("b", 1, "b", 1, 0, 5, 0.05, 10, [0], [0], [0, 1], [0, 0], [0, 1])
    check_manifest(good, QUICK)
    with pytest.raises(WireError, match="bad manifest"):
        check_manifest(msgspec.structs.replace(good, **change), QUICK)


def test_a_map_too_large_is_refused():
    from mrslam.comms.maps.manifests import check_extent
    from mrslam.comms.maps.snapshots import Snapshot
    from mrslam.comms.wire.frames import WireError

    near = m.Manifest("b", 1, "b", 1, 0, 5, 0.05, 10, [0], [0], [0, 100], [0, 100], [0, 1])
    cells = np.zeros((64, 64), dtype=np.int8)
    check_extent(near, Snapshot(1, TiledMap(0.05), ()), QUICK)
    for far, base in (
        (msgspec.structs.replace(near, rows=[0, 2**19], cols=[0, 2**19]), {}),
        (near, {(2**19, -(2**19)): Tile(1, cells)}),
    ):
        with pytest.raises(WireError, match="too large"):
            check_extent(far, Snapshot(1, TiledMap(0.05, base), ()), QUICK)
    with pytest.raises(WireError, match="too large"):
        check_extent(near, Snapshot(1, TiledMap(0.05, {(5, 5): Tile(1, cells)}), ()), replace(QUICK, max_tiles=2))


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


@pytest.mark.parametrize("claimed", [2**61 + 2**32, 2**62 - 2, 2**62])
def test_a_lie_about_ones_own_epoch_leaves_room_to_begin_maps(claimed):
    team = Team("ab")
    liar = m.Open("evil", 1, 7, [("a", claimed, 1)], [])
    beacon = m.Beacon("evil", 1, 1, 1000, 1000, 0, [], 0, None)
    for message in (beacon, liar):
        team.nodes["a"].on_message(m.encode(message, TAG), team.now_ns, "evil")
        team.nodes["a"].set_link_quality("evil", 1.0, team.now_ns)
    team.nodes["a"].on_message(m.encode(liar, TAG), team.now_ns, "evil")
    team.nodes["a"].on_peer_left("evil", team.now_ns)
    for _ in range(3):
        team.publish("a")
        assert team.run_until(lambda: team.nodes["b"].store.version("a") == team.nodes["a"].store.version("a"), 20)
        team.nodes["a"].begin_map()
    assert team.nodes["b"].store.version("a") > (0, 0) and not team.nodes["b"].dropped
