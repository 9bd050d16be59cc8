"""Mission time in a process: the wall clock's, or one that the process playing the mission advances."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Protocol


class Counter(Protocol):
    """A whole number that another process changes."""

    value: int


@dataclass(frozen=True)
class WallClock:
    """Mission time is wall time since the clock was made: for robots on their own."""

    start_ns: int = field(default_factory=time.monotonic_ns)

    def now_ns(self) -> int:
        """Return mission time now, nanoseconds."""
        return time.monotonic_ns() - self.start_ns

    def wall_s(self, mission_ns: int) -> float:
        """Return how many seconds of wall time a span of mission time lasts."""
        return mission_ns / 1e9


@dataclass(frozen=True)
class SharedClock:
    """Mission time that another process advances, at most at ``speed``: it waits for robots that cannot keep up."""

    counter: Counter
    """Mission time, nanoseconds."""
    speed: float = 1.0
    """Mission seconds in a second of wall time, at most."""

    def now_ns(self) -> int:
        """Return mission time now, nanoseconds."""
        return int(self.counter.value)

    def wall_s(self, mission_ns: int) -> float:
        """Return how many seconds of wall time a span of mission time lasts at least."""
        return mission_ns / 1e9 / self.speed


Clock = WallClock | SharedClock
