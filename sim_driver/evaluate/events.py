"""What a run's events say as a whole."""

from __future__ import annotations

from collections.abc import Iterable

from mrslam.comms import is_saved
from mrslam.sim_driver.missions.run_folder import Event


def first_merge_s(robots: Iterable[list[Event]]) -> float | None:
    """Return when the first of these robots merged two robots' maps, right or wrong; None where none did.

    A saved map that a robot was localised in is none of them.
    """
    merged = (event for events in robots for event in events if event["event"] == "merged")
    return min((one["t"] for one in merged if not (is_saved(one["a"]) or is_saved(one["b"]))), default=None)
