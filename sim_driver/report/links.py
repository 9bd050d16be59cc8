"""What the links were like over time, and what went over them."""

from __future__ import annotations

from typing import Any

from mrslam.sim_driver.evaluate.network import quality_over_time
from mrslam.sim_driver.evaluate.results import RunResults


def link_data(run: RunResults, a: str, b: str, end_s: float) -> dict[str, Any]:
    """Return one link's quality over time, its exchanges ``[t, how they ended]``, and when its two maps merged."""
    times, values = quality_over_time(run.events[a], b, end_s)
    marks = [
        [event["t"], event["event"].removeprefix("exchange_")]
        for event in run.events[a]
        if event.get("peer") == b and event["event"] in ("exchange_done", "exchange_failed")
    ]
    merged = [e["t"] for r in (a, b) for e in run.events[r] if e["event"] == "merged" and {e["a"], e["b"]} == {a, b}]
    curve = [[round(float(t), 2), round(float(v), 3)] for t, v in zip(times, values, strict=True)]
    return {"a": a, "b": b, "quality": curve, "exchanges": marks, "merged_s": min(merged, default=None)}


def traffic_curve(run: RunResults, end_s: float) -> list[list[float]]:
    """Return ``[t, sent, whole maps with LZ4, whole maps raw]``, bytes in all exchanges so far."""
    done = sorted((e for events in run.events.values() for e in events if e["event"] == "exchange_done"), key=_at)
    curve = [[0.0, 0, 0, 0]]
    for event in done:
        costs = (event["bytes_sent"], event["bytes_full_lz4"], event["bytes_full_raw"])
        curve.append([event["t"], *(before + cost for before, cost in zip(curve[-1][1:], costs, strict=True))])
    return [*curve, [end_s, *curve[-1][1:]]]


def _at(event: dict[str, Any]) -> float:
    return float(event["t"])
