from __future__ import annotations

from mrslam.agent.effects import as_event
from mrslam.agent.link_stats import LinkStats
from mrslam.comms import ExchangeCosts, ExchangeDone

DONE = ExchangeDone("r2", ExchangeCosts(100, 50, 1000, 9000, 3, 0.123456), "complete")


def test_exchanges_add_up() -> None:
    stats = LinkStats()
    stats.add(DONE)
    stats.add(DONE)
    assert stats.row() == {"exchanges": 2, "bytes_sent": 200, "bytes_full_lz4": 2000, "bytes_full_raw": 18000}


def test_a_network_effect_becomes_a_plain_event() -> None:
    event = as_event(DONE, 5)
    assert event.kind == "exchange_done"
    assert event.fields["peer"] == "r2" and event.fields["seconds"] == 0.1235
