"""Mission time in a process: wall time since a common start, times a speed."""

from __future__ import annotations

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class MissionClock:
    """Counts mission nanoseconds from ``start_s`` (``time.monotonic``, one clock for all processes of a host)."""

    start_s: float
    speed: float = 1.0
    """Mission seconds that pass in a second of wall time."""

    def now_ns(self) -> int:
        """Return mission time now, nanoseconds; negative before the start."""
        return round((time.monotonic() - self.start_s) * self.speed * 1e9)

    def wall_s(self, mission_ns: int) -> float:
        """Return how many seconds of wall time a span of mission time lasts."""
        return mission_ns / 1e9 / self.speed
