"""A robot's ``events.jsonl``, read."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import Any

Event = dict[str, Any]


def read_events(path: Path) -> list[Event]:
    """Return the events of a file, without lines that a crash cut off; none where there is no file."""
    events: list[Event] = []
    if not path.exists():
        return events
    for line in path.read_text(encoding="utf-8").splitlines():
        try:
            events.append(json.loads(line))
        except ValueError:
            continue
    return events


def first_merge_s(robots: Iterable[list[Event]]) -> float | None:
    """Return when the first of these robots merged another's map, right or wrong; None where none did."""
    return min((event["t"] for events in robots for event in events if event["event"] == "merged"), default=None)
