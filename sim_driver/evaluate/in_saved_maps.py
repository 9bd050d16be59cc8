"""Whether robots found their place in saved maps, by their events."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from mrslam.sim_driver.missions.run_folder import Event

FOUND, GONE = ("localised", "tracking"), ("not_localised", "lost")


def in_saved_maps(events: Mapping[str, Sequence[Event]]) -> list[dict[str, Any]]:
    """Return a row for each robot and saved map that it was localised in: since when, and whether it was lost there.

    A row: ``robot``, ``map``, ``localised_s``, ``lost_s`` (None where it knew its place to the end) and ``reason``.
    """
    rows: dict[tuple[str, str], dict[str, Any]] = {}
    for robot_id, told in events.items():
        for event in told:
            kind, key = event["event"], (robot_id, str(event.get("map")))
            if kind in FOUND:
                new = {"robot": robot_id, "map": key[1], "localised_s": event["t"]}
                rows[key] = {**rows.get(key, new), "lost_s": None, "reason": ""}
            elif kind in GONE and key in rows:
                rows[key] |= {"lost_s": event["t"], "reason": event.get("reason", "")}
    return list(rows.values())


def as_words(row: dict[str, Any]) -> str:
    """Return a row of :func:`in_saved_maps` as a sentence without its full stop."""
    found = f"{row['robot']} was localised in {row['map']} after {row['localised_s']:.0f} s"
    return found if row["lost_s"] is None else f"{found}, and lost there after {row['lost_s']:.0f} s: {row['reason']}"
