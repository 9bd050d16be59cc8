"""What went over the links in a run, as curves over time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

from mrslam.sim_driver.report.links import link_data, traffic_curve


def done(t: float, peer: str, sent: int, kind: str = "done") -> dict[str, Any]:
    sizes = {"bytes_sent": sent, "bytes_full_lz4": 2 * sent, "bytes_full_raw": 3 * sent}
    return {"t": t, "event": f"exchange_{kind}", "peer": peer, "reason": "", **sizes}


def merged(t: float, a: str, b: str) -> dict[str, Any]:
    return {"t": t, "event": "merged", "a": a, "b": b}


EVENTS = {
    "r1": [done(8.0, "r2", 100), done(20.0, "r3", 1), done(30.0, "r2", 5, "failed"), merged(25.0, "r1", "r2")],
    "r2": [done(8.0, "r1", 10), merged(9.0, "r2", "r3"), done(12.0, "r1", 7), merged(14.0, "r1", "r2")],
}
RUN: Any = SimpleNamespace(events=EVENTS)


def test_traffic_adds_up_in_the_order_of_time_over_all_robots() -> None:
    curve = traffic_curve(RUN, 40.0)
    assert [point[:2] for point in curve] == [[0.0, 0], [8.0, 100], [8.0, 110], [12.0, 117], [20.0, 118], [40.0, 118]]
    assert curve[-1] == [40.0, 118, 236, 354]


def test_a_link_shows_its_own_exchanges_and_when_the_first_of_its_two_robots_merged() -> None:
    link = link_data(RUN, "r1", "r2", 40.0)
    assert link["exchanges"] == [[8.0, "done"], [30.0, "failed"]]
    assert link["merged_s"] == 14.0
