"""What a robot that was down at the end believed, by its events: each was on its disk at once, its summary never."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from mrslam.sim_driver.missions.run_folder import Event


def map_begun_s(events: Sequence[Event]) -> float:
    """Return when a robot mapped the first scan of its last map, seconds; 0 where it mapped none."""
    mapped_s = [event["t"] for event in _of_last_map(events) if event["event"] == "mapped"]
    return float(mapped_s[0]) if mapped_s else 0.0


def anew_s(events: Sequence[Event]) -> float | None:
    """Return when a robot began a map after it had given one up, seconds; None where its first is its last."""
    return map_begun_s(events) if len(_of_last_map(events)) < len(events) else None


def pairs_by_events(events: Sequence[Event]) -> list[dict[str, Any]]:
    """Return the pairs that a robot had merged when its events end, as rows of ``robot.json``."""
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for event in _of_last_map(events):
        kind, pair = event["event"], (str(event.get("a")), str(event.get("b")))
        if kind == "merged":
            rows[pair] = {
                "a": event["a"],
                "b": event["b"],
                "status": "accepted",
                "T_a_b": event["T_a_b"],
                "accepted_at_s": event["t"],
                "confidence": event["confidence"],
                "reason": "accepted",
            }
        elif kind == "alignment" and pair in rows and event.get("T_a_b") is not None:
            rows[pair] |= {"T_a_b": event["T_a_b"], "confidence": event["confidence"]}
        elif kind == "unmerged" and pair in rows:
            rows[pair] |= {"status": "revoked", "T_a_b": None, "accepted_at_s": None, "reason": event["reason"]}
    return list(rows.values())


def _of_last_map(events: Sequence[Event]) -> Sequence[Event]:
    """Return the events since the robot last began a map: it gave one up, lost its place, or came back from nothing."""
    begun = [i for i, event in enumerate(events) if event["event"] in ("given_up", "lost") or _from_nothing(event)]
    return events[begun[-1] + 1 :] if begun else events


def _from_nothing(event: Event) -> bool:
    return event["event"] == "restarted" and not event["checkpoint"]
