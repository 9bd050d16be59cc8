"""What a node does about the exchange and the link with a teammate that restarts, leaves, or does not hear it."""

from __future__ import annotations

from dataclasses import replace

from mrslam.comms import CommsNode, ExchangeDone, ExchangeFailed, LinkChanged, PeerGone, PeerSeen, Send
from mrslam.comms.wire.frames import team_tag
from mrslam.comms.wire.messages import Beacon, Bye, Done, Open, decode, encode
from tests.comms.puppet import BOOT, Puppet
from tests.comms.team import QUICK, SECOND

TAG = team_tag("team")
MEASURED = replace(QUICK, link_source="measured")


def beacon(peer: str, seq: int, *, boot: int = BOOT, heard: list[tuple[str, int]] | None = None) -> Beacon:
    return Beacon(peer, boot, seq, 1000 * seq, 1000, 0, heard or [], 0, None)


def hear(node: CommsNode, heard: list[tuple[str, int]], seconds: int = 20) -> list[object]:
    """Let a node hear a beacon of b a second, and return its effects."""
    effects: list[object] = []
    for k in range(seconds):
        effects += node.on_message(encode(beacon("b", k, heard=heard), TAG), k * SECOND, "b")
        effects += node.on_tick(k * SECOND)
    return effects


def test_a_teammate_that_restarted_is_met_again_though_the_last_exchange_was_just_now() -> None:
    node = CommsNode("a", "team", 1, replace(QUICK, exchange_timeout_s=1000.0))
    b = Puppet(node, "b")
    b.meet()
    assert any(isinstance(effect, ExchangeDone) for effect in b.say(Done("b", b.xid, 0)))
    assert not [
        e for e in node.on_tick(SECOND) if isinstance(e, Send) and isinstance(decode(e.payload, TAG, 9999), Open)
    ]
    b.say(beacon("b", 0, boot=BOOT + 1))
    sent = [decode(e.payload, TAG, 9999) for e in node.on_tick(2 * SECOND) if isinstance(e, Send)]
    assert [type(message) for message in sent if not isinstance(message, Beacon)] == [Open]


def test_the_exchange_with_a_teammate_that_leaves_ends_at_once() -> None:
    node = CommsNode("a", "team", 1, MEASURED)
    assert [e.peer for e in hear(node, [("a", 100)]) if isinstance(e, PeerSeen)] == ["b"]
    now_ns = 20 * SECOND
    node.on_message(encode(Open("b", BOOT, 1, [("b", BOOT, 1)], [], None), TAG), now_ns, "b")
    left = node.on_message(encode(Bye("b", BOOT), TAG), now_ns, "b")
    assert [e.reason for e in left if isinstance(e, ExchangeFailed)] == ["b left"]
    assert [e.reason for e in left if isinstance(e, PeerGone)] == ["left"]


def test_the_link_to_a_robot_that_does_not_say_that_it_hears_us_never_gets_strong() -> None:
    states = {
        own: [e.state for e in hear(CommsNode(own, "team", 1, MEASURED), [("a", 100)]) if isinstance(e, LinkChanged)]
        for own in ("a", "c")
    }
    assert states["a"][-1] == 1 and set(states["c"]) == {0}


def test_beacons_put_no_more_robots_in_sight_than_there_may_be() -> None:
    node = CommsNode("a", "team", 1, replace(QUICK, max_robots=2))
    for k in (0, 1, 2, 0):
        node.on_message(encode(beacon(f"r{k}", k), TAG), 0, f"r{k}")
    assert sorted(node.peers) == ["r0", "r1"] and node.dropped["too many robots"] == 1
