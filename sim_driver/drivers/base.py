"""What every driver offers."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from mrslam.spatial import OccupancyGrid, Scan
from mrslam.spatial.se2 import Transform

Command = tuple[float, float]
"""Speed (m/s) and turn (rad/s, counter-clockwise)."""
STOP: Command = (0.0, 0.0)


class Driver(Protocol):
    """Decides where one robot goes, from what that robot knows: never from the truth."""

    @property
    def finished(self) -> bool:
        """Whether there is nothing left to do; may become false again when the map grows by a teammate's."""

    def command(
        self,
        now_ns: int,
        T_map_base: Transform,
        grid: OccupancyGrid | None,
        teammates: Mapping[str, Transform],
        scan: Scan | None = None,
    ) -> Command:
        """Return what to drive until the next call, about a tenth of a second.

        ``grid`` : own or team map in this robot's map frame, None before there is one. ``teammates`` : poses of
        those whose place is known, on that map. ``scan`` : the newest sweep, for what moves and is not in the map.
        """
