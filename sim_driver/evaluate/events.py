"""What a run's events say as a whole."""

from __future__ import annotations

from collections.abc import Iterable

from mrslam.sim_driver.missions.run_folder import Event


def first_merge_s(robots: Iterable[list[Event]]) -> float | None:
    """Return when the first of these robots merged another's map, right or wrong; None where none did."""
    return min((event["t"] for events in robots for event in events if event["event"] == "merged"), default=None)
