"""What the mapper reports about each scan, and its counters."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field

from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, kw_only=True, eq=False)
class UpdateInfo:
    """What the mapper did with one scan."""

    processed: bool
    """Whether the scan became a keyframe, at which the filter is updated."""
    T_map_base: Transform
    """``(3,)``, the best pose known now."""
    neff: float
    """Effective number of particles at the newest keyframe whose result is known."""
    resampled: bool = False
    """Whether particles were resampled at the keyframe whose result was collected with this scan."""
    match_score: float = 0.0
    """Share of beams that fit the rolling map, 0..1 (inliers, not the matcher's log-likelihood)."""
    health: float = 1.0
    """0..1; below 0.5 the pose is doubtful."""
    is_lost: bool = False
    """Whether the robot was carried, or came where its map does not show it, and was not found in its map since."""
    dropped_beams: int = 0
    """Number of beams that are no usable return."""
    reason: str | None = None
    """Why the scan was not used; None where it was."""


@dataclass(eq=False)
class Stats:
    """Counts since the start; what the back end reports is counted once its result is collected."""

    scans: int = 0
    """Scans that came, used or not."""
    dropped: int = 0
    """Scans that were not used."""
    processed: int = 0
    """Keyframes, also those whose results are not known yet."""
    seen_before: int = 0
    """Keyframes whose scans were not kept, for earlier ones show what they saw."""
    resamplings: int = 0
    """Keyframes at which particles were resampled."""
    neff_min: float = math.inf
    """Least effective number of particles so far; inf before the first."""
    loops_closed: int = 0
    """Keyframes at which the trajectory was relaxed and the maps drawn again."""


@dataclass(eq=False)
class Stopwatch:
    """Seconds by stage on one thread; without a clock it measures nothing and costs nothing."""

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
