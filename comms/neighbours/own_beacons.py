"""The own beacons: when they are sent, and their content."""

from __future__ import annotations

import numpy as np

from mrslam.comms.config import MODES
from mrslam.comms.exchange.station import Station
from mrslam.comms.neighbours.beacon_clock import BeaconClock
from mrslam.comms.wire.keyframe_codec import quantise
from mrslam.comms.wire.messages import Beacon
from mrslam.spatial.se2 import Transform

LEVELS = 100
"""A share of beacons received is sent as a whole number of percent."""


class OwnBeacons:
    """Sends this robot's beacons."""

    def __init__(self, station: Station) -> None:
        """Nothing is sent before the first tick."""
        self._station = station
        self._clock = BeaconClock(station.config)
        self._started_ns: int | None = None
        self._pose: tuple[int, int, int, int] | None = None  # x (mm), y (mm), theta (0.1 mrad), stamp (ns)

    def set_pose(self, T_map_base: Transform, stamp_ns: int) -> None:
        """Set the pose ``(3,)`` (m, m, rad) that beacons carry, and its time, nanoseconds."""
        x, y, theta = (int(v) for v in quantise(np.asarray(T_map_base, dtype=np.float64)))
        self._pose = (x, y, theta, int(stamp_ns))

    def uptime_ms(self, now_ns: int) -> int:
        """Return the time since the first tick, milliseconds."""
        return 0 if self._started_ns is None else max(now_ns - self._started_ns, 0) // 1_000_000

    def start(self, now_ns: int) -> None:
        """Count the uptime from the first call."""
        if self._started_ns is None:
            self._started_ns = now_ns

    def is_due(self, now_ns: int, *, calm: bool) -> bool:
        """Return whether to send a beacon now."""
        return self._clock.is_due(now_ns, calm=calm)

    def send(self, heard: list[tuple[str, float]], now_ns: int, *, calm: bool) -> None:
        """Send a beacon; ``heard``: share of their beacons received from the neighbours it reports, 0..1."""
        station = self._station
        period_ns = self._clock.next(now_ns, calm=calm)
        pose = self._pose
        beacon = Beacon(
            station.own_id,
            station.boot,
            self._clock.seq,
            self.uptime_ms(now_ns),
            max(round(period_ns / 1e6), 1),
            MODES.index(station.mode),
            [(peer, round(LEVELS * share)) for peer, share in heard],
            station.store.own_epoch - station.boot,
            None if pose is None else (*pose[:3], max(now_ns - pose[3], 0) // 1_000_000),
        )
        station.out.post(beacon, None, "beacon")
