"""The network in memory: who hears what of whom, and when."""

from __future__ import annotations

import pytest

from mrslam.comms import Send
from mrslam.comms.transport.base import Incoming, PeerJoined, PeerLeft, TransportEvent
from mrslam.comms.transport.memory import LEASE_NS, LinkConditions, MemoryNetwork, MemoryTransport

S = 1_000_000_000


def network(**conditions: float) -> tuple[MemoryNetwork, MemoryTransport, MemoryTransport]:
    """Return a network of r1 and r2, who have seen each other join."""
    made = MemoryNetwork(conditions=lambda sender, receiver, now_ns: LinkConditions(**conditions), queue_s=3.0)
    one, two = made.attach("r1"), made.attach("r2")
    made.advance(0)
    assert one.poll() == [PeerJoined("r2")] and two.poll() == [PeerJoined("r1")]
    return made, one, two


def payloads(arrived: list[TransportEvent]) -> list[bytes]:
    return [one.payload for one in arrived if isinstance(one, Incoming)]


def test_a_robot_that_leaves_is_gone_after_its_goodbye_has_arrived() -> None:
    net, one, two = network(delay_s=2.0)
    one.send(Send(None, b"bye", "control"))
    one.close()
    net.advance(S)
    assert two.poll() == []
    net.advance(3 * S)
    assert two.poll() == [Incoming(b"bye", "r1", "control"), PeerLeft("r1")]


def test_a_robot_that_crashes_is_gone_when_its_lease_is_over() -> None:
    net, _, two = network()
    net.crash("r1")
    net.advance(LEASE_NS - 1)
    assert two.poll() == []
    net.advance(LEASE_NS)
    assert two.poll() == [PeerLeft("r1")]


def test_a_robot_of_two_processes_is_gone_when_the_second_leaves() -> None:
    net, one, two = network()
    twin = net.attach("r1", twin=True)
    net.advance(1)
    two.poll()
    one.close()
    net.advance(S)
    assert two.poll() == []
    twin.close()
    net.advance(2 * S)
    assert two.poll() == [PeerLeft("r1")]


def test_what_would_wait_longer_for_a_slow_link_than_its_queue_holds_is_lost() -> None:
    net, one, two = network(rate_bps=800.0, delay_s=0.0)
    for k in range(9):  # a second each
        one.send(Send("r2", bytes([k]) * 100, "bulk"))
    assert net.queued == 4  # one goes at once, three wait
    net.advance(2 * S)
    assert payloads(two.poll()) == [bytes([k]) * 100 for k in (0, 1)]
    net.advance(4 * S)
    one.send(Send("r2", b"x" * 100, "bulk"))  # there is room again
    net.advance(5 * S)
    assert [payload[0] for payload in payloads(two.poll())] == [2, 3, ord("x")]


@pytest.mark.parametrize("quality", [0.09, 0.25, 0.64])
def test_a_link_of_a_quality_loses_as_many_beacons_of_either_side_as_make_it(quality: float) -> None:
    net, one, two = network(loss=LinkConditions.of_quality(quality).loss)
    for _ in range(2000):
        one.send(Send(None, b"", "beacon"))
        two.send(Send(None, b"", "beacon"))
    net.advance(S)
    shares = [len(end.poll()) / 2000 for end in (one, two)]
    assert shares[0] * shares[1] == pytest.approx(quality, abs=0.05)


def test_of_lanes_that_are_reliable_nothing_is_lost_doubled_or_overtaken() -> None:
    net, one, two = network(loss=0.4, duplicate=0.5, jitter_s=1.0)
    for k in range(100):
        one.send(Send("r2", bytes([k]), "control"))
        one.send(Send(None, bytes([k]), "beacon"))
    net.advance(60 * S)
    arrived = two.poll()
    control, beacons = (
        [one.payload[0] for one in arrived if isinstance(one, Incoming) and one.lane == lane]
        for lane in ("control", "beacon")
    )
    assert control == list(range(100))
    assert len(set(beacons)) < 80 and len(set(beacons)) < len(beacons) and beacons != sorted(beacons)
