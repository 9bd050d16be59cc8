"""What is counted of exchanges."""

from __future__ import annotations

from mrslam.comms import ExchangeCosts, ExchangeDone, ExchangeFailed
from mrslam.comms.exchange.outgoing import Outgoing, Totals


def test_an_exchange_that_failed_costs_its_bytes_and_stands_for_no_whole_map() -> None:
    out, costs = Outgoing("team"), ExchangeCosts(100, 50, 1000, 9000, 3, 1.0)
    out.emit(ExchangeFailed("b", costs, "no answer"))
    assert out.totals["b"] == Totals(100, 50, 0, 0)
    out.emit(ExchangeDone("b", costs, "complete"))
    assert out.totals["b"] == Totals(200, 100, 1000, 9000)
