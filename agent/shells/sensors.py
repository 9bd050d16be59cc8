"""A body whose laser and wheels are real: drivers hand in what they measure, from any thread."""

from __future__ import annotations

import threading
from bisect import bisect_right
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING

from mrslam.agent.shells.body import Sensed
from mrslam.agent.shells.clock import Clock
from mrslam.spatial import Scan, se2
from mrslam.spatial.se2 import Transform

if TYPE_CHECKING:
    from mrslam.agent.core import Agent

WAITING = 2
"""Most scans that wait; a further one replaces the oldest, because the newest place matters."""
ODOMETRY_KEPT = 200
"""Odometry readings kept to interpolate at a scan's stamp: 1 s at 200 Hz, more than a scan waits."""
ODOMETRY_AGE_NS = 200_000_000
"""Odometry farther from a scan's stamp than this is not used for it, nanoseconds: at 1 m/s an error of 0.2 m."""


class SensorBody:
    """Holds the newest scans for the agent; :attr:`scans_lost` counts those it was too slow for."""

    finished = False
    next_ns: int | None = None

    def __init__(self, clock: Clock, *, patience_s: float = 0.0, on_ready: Callable[[], None] = lambda: None) -> None:
        """Take the agent's clock.

        ``patience_s`` : a scan that has waited for less is never replaced; ``on_ready()`` is called after each scan, on
        the driver's thread, and may wake the agent.
        """
        self.scans_lost = 0
        self.on_ready = on_ready
        self._clock = clock
        self._patience_ns = round(patience_s * 1e9)
        self._waiting: deque[Sensed] = deque()
        self._odometry: deque[tuple[int, Transform]] = deque(maxlen=ODOMETRY_KEPT)
        self._lock = threading.Lock()

    def on_scan(self, scan: Scan, T_odom_base: Transform | None = None) -> None:
        """Take a scan; without odometry of its own it gets what the wheels said at its stamp."""
        with self._lock:
            if T_odom_base is None:
                T_odom_base = self._odometry_at(scan.stamp_ns)
            now_ns = self._clock.now_ns()
            self._waiting.append(Sensed(now_ns, scan, T_odom_base))
            if len(self._waiting) > WAITING and now_ns - self._waiting[0].t_ns >= self._patience_ns:
                self._waiting.popleft()
                self.scans_lost += 1
        self.on_ready()

    def on_odometry(self, stamp_ns: int, T_odom_base: Transform) -> None:
        """Take an odometry reading."""
        with self._lock:
            self._odometry.append((stamp_ns, T_odom_base))

    def _odometry_at(self, stamp_ns: int) -> Transform | None:
        """Return the pose at this moment, between the readings around it; None where none is near."""
        by_stamp = sorted(self._odometry, key=lambda one: one[0])  # networks may deliver one late
        after = bisect_right(by_stamp, stamp_ns, key=lambda one: one[0])
        around = by_stamp[max(after - 1, 0) : after + 1]
        near = [one for one in around if abs(one[0] - stamp_ns) <= ODOMETRY_AGE_NS]
        if len(near) < 2:
            return near[0][1] if near else None
        (t0, T0), (t1, T1) = near
        share = (stamp_ns - t0) / (t1 - t0)
        return se2.compose(T0, share * se2.between(T0, T1))

    def sense(self, now_ns: int) -> Sensed | None:
        """Return the oldest scan that waits."""
        with self._lock:
            return self._waiting.popleft() if self._waiting else None

    def act(self, agent: Agent, now_ns: int) -> None:
        """Nothing to drive: somebody else steers."""
