"""What the mapper tells about each scan, and what it has counted."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class UpdateInfo:
    """What became of one scan."""

    processed: bool
    """Whether the filter was updated, not only the local motion."""
    T_map_base: Transform
    """``(3,)``, the best pose known now."""
    neff: float
    """Effective number of particles."""
    resampled: bool = False
    """Whether particles were resampled, as far as it is told with this scan: the filter works while more scans come."""
    match_score: float = 0.0
    """Share of beams that fit the local map, 0..1."""
    health: float = 1.0
    """0..1; below 0.5 the pose is doubtful."""
    dropped_beams: int = 0
    """Beams that are no usable return."""
    reason: str | None = None
    """Why the scan was not used; None where it was."""


@dataclass(eq=False)
class Stats:
    """Counts since the start, as far as they have been told."""

    scans: int = 0
    dropped: int = 0
    processed: int = 0
    resamplings: int = 0
    neff_min: float = math.inf
    loops_closed: int = 0


@dataclass(eq=False)
class Stopwatch:
    """Seconds by stage on one thread, for those who measure; without a clock it costs nothing and tells nothing."""

    clock: Callable[[], float] | None = None
    """Seconds so far, such as ``time.thread_time``."""
    seconds: dict[str, float] = field(default_factory=dict)
    """By stage."""
    _since: float = 0.0

    def start(self) -> None:
        """Begin the first stage."""
        if self.clock is not None:
            self._since = self.clock()

    def lap(self, stage: str) -> None:
        """End this stage and begin the next."""
        if self.clock is not None:
            now = self.clock()
            self.seconds[stage] = self.seconds.get(stage, 0.0) + now - self._since
            self._since = now
