"""When a robot's processor cannot keep up with its laser: fewer particles, down to a floor, with an event."""

from __future__ import annotations

from dataclasses import dataclass

LATE_S = 0.2
"""A scan mapped later than this after it was taken is late, seconds: two periods of a 10 Hz laser."""
MEMORY = 0.05
"""Weight of each scan in the share of late ones: averages over about 20 scans, two seconds of a 10 Hz laser."""
OFTEN = 0.5
"""Share of late scans from which the mapper is overloaded; a single delay stays below it."""
SETTLE_S = 3.0
"""Least time between two reductions, seconds: the share of late scans needs two seconds to follow a change."""
CALM_S, CALM_MOST_S = 30.0, 600.0
"""Time without a late scan after which the number of particles is raised, seconds; doubled up to the second value
each time a reduction follows."""
FLOOR = 8
"""Least particles, as fewer hardly keep hypotheses for closing loops; below, scans are dropped instead."""


@dataclass
class Overload:
    """Watches the age of scans, and sets how many particles the mapper uses.

    ``wanted`` : what the settings ask for. Lateness and loss have one cause, a mapper that takes longer than the laser.
    """

    wanted: int
    count: int = 0
    """Particles in use now."""
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
