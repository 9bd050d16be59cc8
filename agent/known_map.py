"""A robot's map as last published, with what is derived from it once."""

from __future__ import annotations

import weakref
from dataclasses import dataclass, field
from functools import cached_property

from mrslam.alignment import look_alikes, open_share
from mrslam.merge import Trail
from mrslam.spatial import LocalMap, OccupancyGrid

MOST_LOOK_ALIKES = 0.1
"""Look-alikes that a place of a saved map may have beyond it for a robot to believe that it is there: one in ten. By
this count (:func:`mrslam.alignment.look_alikes`) buildings and halves of large ones have 0.00 to 0.08, what a robot
sees in a dozen seconds 0.15 and more."""
MOST_OPEN = 0.05
"""Open share of the outline up to which a saved map shows all of a building: hotels and offices that were explored to
the end have 0.01 to 0.05, those that were not 0.06 and more, real logs, whose walls have gaps, 0.03 to 0.8."""
Version = tuple[int, int]
"""(epoch, revision): a higher epoch is another map in another frame, a higher revision the same map grown."""


@dataclass(frozen=True, eq=False)
class KnownMap:
    """One version of one robot's map."""

    version: Version
    local: LocalMap
    _held: list[weakref.ref[OccupancyGrid]] = field(default_factory=list, init=False, repr=False)

    @property
    def epoch(self) -> int:
        """Which of the robot's maps this is; maps of one epoch have one frame."""
        return self.version[0]

    @property
    def grid(self) -> OccupancyGrid:
        """The map as one grid, kept for as long as somebody else holds it: of a large building it takes megabytes."""
        held = self._held[0]() if self._held else None
        if held is None:
            held = self.local.map.to_grid()
            self._held[:] = [weakref.ref(held)]
        return held

    @cached_property
    def trail(self) -> Trail:
        """The map's keyframes that have scans."""
        return Trail.of(self.local)

    @cached_property
    def area_m2(self) -> float:
        """Known area, square metres."""
        return self.local.map.known_area_m2()

    @cached_property
    def look_alikes(self) -> float:
        """Look-alikes of one of its places to be expected beyond the map."""
        return look_alikes(self.grid, MOST_LOOK_ALIKES)

    @cached_property
    def is_whole(self) -> bool:
        """Whether it shows all of a building: its floor ends at walls."""
        return open_share(self.grid) <= MOST_OPEN
