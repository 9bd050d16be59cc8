"""A bounded queue of arrivals, filled by the network's threads and emptied by the robot's own."""

from __future__ import annotations

import logging
import threading
from collections import Counter, deque

from mrslam.comms.milestones import is_milestone
from mrslam.comms.transport.base import Incoming, TransportEvent

log = logging.getLogger(__name__)

MAX_BEACONS = 4096
"""Beacons kept: 8 s of those of ``max_robots`` at their fastest default pace; bounds memory alone."""
MAX_BYTES = 64 << 20
"""Bytes of other messages kept: some 250 of the largest messages; bounds memory alone."""


class Inbox:
    """A queue in which beacons push out older beacons, and other messages are refused above a bound of bytes."""

    def __init__(self, max_bytes: int = MAX_BYTES, max_beacons: int = MAX_BEACONS) -> None:
        """Make an empty queue."""
        self._max_bytes = max_bytes
        self._ready = threading.Condition()
        self._beacons: deque[TransportEvent] = deque(maxlen=max_beacons)
        self._others: deque[TransportEvent] = deque()
        self._bytes = 0
        self._woken = False
        self.refused: Counter[str] = Counter()
        """Messages not taken, by lane; of beacons those that newer ones pushed out."""

    def put(self, arrival: TransportEvent) -> None:
        """Add what arrived; never waits."""
        with self._ready:
            if isinstance(arrival, Incoming) and arrival.lane == "beacon":
                if len(self._beacons) == self._beacons.maxlen:
                    self._refuse(arrival.lane)
                self._beacons.append(arrival)
            else:
                if isinstance(arrival, Incoming):
                    if self._bytes + len(arrival.payload) > self._max_bytes:
                        self._refuse(arrival.lane)
                        return
                    self._bytes += len(arrival.payload)
                self._others.append(arrival)
            self._ready.notify()

    def _refuse(self, lane: str) -> None:
        self.refused[lane] += 1
        if is_milestone(count := self.refused[lane]):
            log.warning("%d messages (%s) were not taken: too many wait for the robot", count, lane)

    def wake(self) -> None:
        """End the wait that is under way, or the next one: the robot has something else to do."""
        with self._ready:
            self._woken = True
            self._ready.notify()

    def take(self, timeout_s: float) -> list[TransportEvent]:
        """Return all that arrived, liveliness and maps before beacons; wait at most ``timeout_s`` for the first."""
        with self._ready:
            if not self._beacons and not self._others and not self._woken and timeout_s > 0.0:
                self._ready.wait(timeout_s)
            self._woken = False
            taken = [*self._others, *self._beacons]
            self._others.clear()
            self._beacons.clear()
            self._bytes = 0
            return taken
