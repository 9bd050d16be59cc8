"""A robot's map as last published, with what is derived from it once."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from mrslam.merge import Trail
from mrslam.spatial import LocalMap, OccupancyGrid

Version = tuple[int, int]
"""(epoch, revision): a higher epoch is another map in another frame, a higher revision the same map grown."""


@dataclass(frozen=True, eq=False)
class KnownMap:
    """One version of one robot's map."""

    version: Version
    local: LocalMap

    @property
    def epoch(self) -> int:
        """Which of the robot's maps this is; maps of one epoch have one frame."""
        return self.version[0]

    @cached_property
    def grid(self) -> OccupancyGrid:
        """The map as one grid."""
        return self.local.map.to_grid()

    @cached_property
    def trail(self) -> Trail:
        """The map's keyframes that have scans."""
        return Trail.of(self.local)

    @cached_property
    def area_m2(self) -> float:
        """Known area, square metres."""
        return self.local.map.known_area_m2()
