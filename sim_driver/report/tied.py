"""When robots' maps were tied to one of them: merged with it, or with another that was."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from mrslam.merge.graph.tree import components


def tied_s(events: Iterable[Mapping[str, Any]], frame: str) -> dict[str, float]:
    """Return by robot when the merges among one robot's ``events`` first tied its map to that of ``frame``, seconds."""
    tied = {frame: 0.0}
    pairs: list[tuple[str, str]] = []
    for event in events:
        if event["event"] == "merged":
            pairs.append((event["a"], event["b"]))
            group = next(g for g in components({frame}.union(*pairs), pairs) if frame in g)
            tied |= {robot: event["t"] for robot in group if robot not in tied}
    return tied
