"""What exchanges remember is bounded, and so is how long one waits before it asks again."""

from __future__ import annotations

from mrslam.comms import CommsConfig
from mrslam.comms.exchange.exchange import MAX_OFFERED, Exchange
from mrslam.comms.exchange.in_flight import InFlight
from mrslam.comms.exchange.outgoing import Outgoing
from mrslam.comms.exchange.past_exchanges import REMEMBERED, PastExchanges
from mrslam.comms.exchange.pull import offer_of
from mrslam.comms.wire.messages import Manifest


def test_of_exchanges_that_are_over_the_oldest_are_forgotten() -> None:
    past = PastExchanges("a", Outgoing("team"))
    for xid in range(REMEMBERED + 3):
        past.add("b", xid, completed=True)
    assert [("b", xid) in past for xid in (0, 2, 3, REMEMBERED + 2)] == [False, False, True, True]


def test_of_manifests_the_oldest_are_forgotten_with_what_was_sent_of_them() -> None:
    exchange = Exchange("b", 1, True, 0, 0)
    manifests = [Manifest("a", 1, "a", 1, 0, k + 1, 0.05, 0, [], [], [0], [0], [0]) for k in range(MAX_OFFERED + 2)]
    for manifest in manifests:
        exchange.offer(manifest)
        exchange.in_flight[offer_of(manifest)] = InFlight(0)
    exchange.offer(manifests[-1])
    assert list(exchange.offered) == [offer_of(one) for one in manifests[2:]]
    assert set(exchange.in_flight) == set(exchange.offered)


def test_silence_before_a_question_is_repeated_grows_to_four_times_and_no_more() -> None:
    exchange, config = Exchange("b", 1, True, 0, 0), CommsConfig(retry_s=0.5)
    waits = []
    for exchange.retries in range(6):
        waits.append(exchange.retry_ns(config) / 1e9)
    assert waits == [0.5, 1.0, 2.0, 2.0, 2.0, 2.0]
