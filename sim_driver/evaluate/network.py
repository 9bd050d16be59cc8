"""What went over the radio in a run, and what the links were like."""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.run_folder import Event


def bytes_by_kind(run: RunResults) -> dict[str, int]:
    """Return the bytes all robots gave to the network by lane, and what whole maps would have cost instead."""
    lanes: dict[str, int] = {}
    for robot in run.robots.values():
        for lane, count in robot.get("sent_bytes", {}).items():
            lanes[lane] = lanes.get(lane, 0) + count
    links = run.metrics["links"]
    return {
        **lanes,
        "exchanges": sum(link["bytes_sent"] for link in links),
        "full_lz4": sum(link["bytes_full_lz4"] for link in links),
        "full_raw": sum(link["bytes_full_raw"] for link in links),
    }


def compared(sent: int, full: int) -> str:
    """Return how many bytes were sent, beside what whole maps would have cost (> 0): "83 % less"."""
    saved = 1.0 - sent / full
    return f"{abs(100 * saved):.0f} % {'less' if saved >= 0 else 'more'}"


def exchanges(events: list[Event], peer: str | None = None) -> dict[str, int]:
    """Return how many exchanges a robot began, ended and lost, by its own events."""
    mine = [event for event in events if peer is None or event.get("peer") == peer]
    counts = {
        kind: sum(event["event"] == f"exchange_{kind}" for event in mine) for kind in ("started", "done", "failed")
    }
    return {**counts, "opened": sum(event["event"] == "exchange_started" and event["opened_by_me"] for event in mine)}


def link_rows(run: RunResults) -> list[dict[str, Any]]:
    """Return a row for every pair of robots: its link's quality over time, and the exchanges over it."""
    threshold = run.mission.settings.comms.link_threshold
    end_s = run.metrics["mission_s"]
    rows = []
    for a, b in combinations(sorted(robot.id for robot in run.mission.robots), 2):
        times, values = quality_over_time(run.events[a], b, end_s)
        weights = np.diff(np.append(times, end_s))
        total = float(weights.sum())
        rows.append(
            {
                "a": a,
                "b": b,
                "quality_mean": round(float(weights @ values / total), 4) if total > 0 else None,
                "share_strong": round(float(weights @ (values >= threshold) / total), 4) if total > 0 else None,
                "in_sight_s": round(_in_sight_s(run.events[a], b, end_s), 1),
                "exchanges": exchanges(run.events[a], b),
            }
        )
    return rows


def quality_over_time(
    events: list[Event], peer: str, end_s: float
) -> tuple[np.ndarray[Any, Any], np.ndarray[Any, Any]]:
    """Return times (s) and the quality from each on, as one robot saw its link; 0 while the peer is out of sight."""
    times, values = [0.0], [0.0]
    for event in events:
        if event.get("peer") != peer or event["event"] not in ("link_changed", "peer_gone"):
            continue
        times.append(min(event["t"], end_s))
        values.append(event["quality"] if event["event"] == "link_changed" else 0.0)
    return np.array(times), np.array(values)


def _in_sight_s(events: list[Event], peer: str, end_s: float) -> float:
    since, total = None, 0.0
    for event in events:
        if event.get("peer") != peer:
            continue
        if event["event"] == "peer_seen" and since is None:
            since = event["t"]
        elif event["event"] == "peer_gone" and since is not None:
            total, since = total + event["t"] - since, None
    return total + (end_s - since if since is not None else 0.0)
