"""A robot's body in a run that is played again: it senses what it sensed then, and goes where it went."""

from __future__ import annotations

from collections.abc import Sequence

from mrslam.agent import Agent, Sensed
from mrslam.sim_driver.simulation.simulated import PLAN_NS


class ReplayedBody:
    """Plays recorded scans at the mission times at which they were taken."""

    def __init__(self, sensed: Sequence[Sensed]) -> None:
        """Take the scans in order."""
        self._sensed, self._next = sensed, 0
        self._look_ns: int | None = None

    def sense(self, now_ns: int) -> Sensed | None:
        """Return the next scan if it is due."""
        due_ns = self.next_ns
        if due_ns is None or due_ns > now_ns:
            return None
        self._next += 1
        return self._sensed[self._next - 1]

    def act(self, agent: Agent, now_ns: int) -> None:
        """Look at the map when a driving robot would: every look counts a revision of the map, told to teammates."""
        if self._next and (self._look_ns is None or now_ns - self._look_ns >= PLAN_NS):
            self._look_ns = now_ns
            if len(agent.T_team_map) == 1:
                agent.local_map()

    @property
    def next_ns(self) -> int | None:
        """When the next scan comes due."""
        return None if self.finished else self._sensed[self._next].t_ns

    @property
    def finished(self) -> bool:
        """Whether all scans were played."""
        return self._next >= len(self._sensed)
