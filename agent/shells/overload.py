"""When a robot's processor cannot keep up with its laser: fewer particles, on purpose, down to a floor, and told."""

from __future__ import annotations

from dataclasses import dataclass

LATE_S = 0.2
"""A scan that is mapped later than this after it was taken is late, seconds."""
MEMORY = 0.05
"""Each scan counts by so much in the share of late ones: about the last two seconds of a usual laser."""
OFTEN = 0.5
"""A larger share of late scans is no hiccup."""
SETTLE_S = 3.0
"""Fewer particles need so long to show whether they are few enough."""
CALM_S, CALM_MOST_S = 30.0, 600.0
"""Without a late scan for so long a robot tries more particles again; twice as long each time that was too early."""
FLOOR = 8
"""Fewer particles than this close no loops; from there on scans are left out instead."""


@dataclass
class Overload:
    """Watches how old scans get, and says how many particles the mapper should go on with.

    ``wanted`` : what the settings ask for. Lateness and loss have one cause, a mapper that takes longer than the laser.
    """

    wanted: int
    count: int = 0
    """How many it goes on with now."""
    late: float = 0.0
    """Share of late scans lately, 0..1."""
    _changed_s: float = 0.0
    _late_s: float = 0.0
    _calm_s: float = CALM_S
    _has_raised: bool = False
    _lost: int = 0

    def __post_init__(self) -> None:
        self.count = self.count or self.wanted

    def look(self, age_s: float, lost: int, now_s: float) -> int | None:
        """Take one scan's age when it had been mapped and how many were lost so far; return a new count, or None."""
        is_late = age_s > LATE_S or lost > self._lost
        self._lost = lost
        self.late += MEMORY * (is_late - self.late)
        if is_late:
            self._late_s = now_s
        floor = min(FLOOR, self.wanted)
        if self.late > OFTEN and self.count > floor and now_s - self._changed_s >= SETTLE_S:
            if self._has_raised:
                self._calm_s = min(2.0 * self._calm_s, CALM_MOST_S)
            return self._change(max(self.count // 2, floor), now_s)
        if self.count < self.wanted and now_s - max(self._late_s, self._changed_s) >= self._calm_s:
            return self._change(min(2 * self.count, self.wanted), now_s)
        return None

    def _change(self, count: int, now_s: float) -> int:
        self._has_raised = count > self.count
        self.count, self._changed_s, self.late = count, now_s, 0.0
        return count
