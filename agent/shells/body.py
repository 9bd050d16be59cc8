"""What a shell needs of a robot's hardware, or of whatever stands in for it: a simulator, a recorded log, a driver."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from mrslam.spatial import Scan
from mrslam.spatial.se2 import Transform

if TYPE_CHECKING:
    from mrslam.agent.core import Agent


@dataclass(frozen=True, eq=False)
class Sensed:
    """One scan with its odometry and the mission time at which it was taken."""

    t_ns: int
    scan: Scan
    T_odom_base: Transform | None
    taken_s: float | None = None
    """``time.monotonic()`` when it was taken, where that is known: how old it gets before it is mapped."""


class Body(Protocol):
    """Senses and acts in mission time."""

    def sense(self, now_ns: int) -> Sensed | None:
        """Return the oldest scan taken up to now that was not returned yet, or None."""

    def act(self, agent: Agent, now_ns: int) -> None:
        """Drive on, by what the agent knows; called after every scan and tick."""

    @property
    def next_ns(self) -> int | None:
        """Mission time of the next scan where it is known, so that a shell can wait for it."""

    @property
    def finished(self) -> bool:
        """Whether no scan will come any more."""
