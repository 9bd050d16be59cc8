"""What is known of one teammate in sight, and the watch for another process with this robot's id."""

from __future__ import annotations

from dataclasses import dataclass, field

from mrslam.comms.wire.messages import Beacon

DUPLICATE_BEACONS = 3
"""Beacons with this robot's id and another boot that prove a second process: one may be late, of an earlier boot."""
MOST_BOOTS = 64
"""Other boots counted at once; bounds memory alone."""


@dataclass
class Peer:
    """A teammate in sight."""

    boot: int = 0
    """0 until its first beacon."""
    mode: int = 0
    """Index in ``MODES``."""
    heard_ns: int = 0
    """When its last beacon arrived, on the own clock."""
    has_token: bool = False
    """Whether its liveliness token is up."""
    last_seq: int = -1
    pose_taken_ms: int | None = None
    """When its last pose was taken, on its own clock."""
    past_boots: tuple[int, ...] = ()
    """Boot ids before the present one, oldest first."""


@dataclass
class DuplicateIdWatch:
    """Counts the beacons of other processes with this robot's id."""

    _seen: dict[int, tuple[int, int]] = field(default_factory=dict)  # boot -> (last seq, beacons)

    def hear(self, beacon: Beacon) -> bool:
        """Count a beacon with this robot's id and another boot; return True once, at the last that the proof needs."""
        last, count = self._seen.get(beacon.boot, (-1, 0))
        if beacon.seq <= last:
            return False
        if len(self._seen) > MOST_BOOTS:
            self._seen.clear()
        self._seen[beacon.boot] = (beacon.seq, count + 1)
        return count + 1 == DUPLICATE_BEACONS


def am_newcomer(own_uptime_ms: int, own_boot: int, other: Beacon) -> bool:
    """Return whether this process is the later of two with one id: the shorter uptime, then the greater boot id."""
    return (own_uptime_ms, -own_boot) < (other.uptime_ms, -other.boot)
