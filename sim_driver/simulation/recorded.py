"""A recorded log as a robot's body: scans come due by their stamps, in file order, none left out."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mrslam.agent import Agent, Sensed
from mrslam.sim_driver.feeds import Reading
from mrslam.spatial import InputError


class RecordedBody:
    """Plays part of a log, beginning at mission time 0. A stamp that runs backward comes due with the one before it."""

    def __init__(self, readings: Sequence[Reading], first: float = 0.0, last: float = 1.0, start_ns: int = 0) -> None:
        """Take the share ``first``..``last`` of the scans, by count; the first comes due at ``start_ns``."""
        count = len(readings)
        self._readings = readings[round(first * count) : round(last * count)]
        if not self._readings:
            raise InputError(f"the share {first}..{last} of a log of {count} scans holds no scan")
        stamps = np.array([reading.scan.stamp_ns for reading in self._readings], dtype=np.int64)
        self._due_ns = (np.maximum.accumulate(stamps) - stamps[0] + start_ns).tolist()
        self._next = 0

    def sense(self, now_ns: int) -> Sensed | None:
        """Return the next scan if it is due."""
        if self.finished or self._due_ns[self._next] > now_ns:
            return None
        reading, due_ns = self._readings[self._next], self._due_ns[self._next]
        self._next += 1
        return Sensed(due_ns, reading.scan, reading.T_odom_base)

    def skip_to(self, now_ns: int) -> None:
        """Leave out what came due before: nobody was there to see it."""
        while not self.finished and self._due_ns[self._next] < now_ns:
            self._next += 1

    def go_on_after(self, stamp_ns: int) -> bool:
        """Leave out what was played before, up to the scan of this stamp; what follows it comes due first.

        False, and nothing is left out, where there is no such scan: it was another log.
        """
        played = [i for i, reading in enumerate(self._readings) if reading.scan.stamp_ns == stamp_ns]
        if not played:
            return False
        self._next = played[-1] + 1
        if not self.finished:
            early_ns = self._due_ns[self._next] - self._due_ns[0]
            self._due_ns = [due_ns - early_ns for due_ns in self._due_ns]
        return True

    def act(self, agent: Agent, now_ns: int) -> None:
        """Nothing to drive: the robot went where it went."""

    @property
    def next_ns(self) -> int | None:
        """When the next scan comes due."""
        return None if self.finished else self._due_ns[self._next]

    @property
    def finished(self) -> bool:
        """Whether the log is played out."""
        return self._next >= len(self._readings)

    @property
    def duration_ns(self) -> int:
        """Mission time of the last scan."""
        return int(self._due_ns[-1])
