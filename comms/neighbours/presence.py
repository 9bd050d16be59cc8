"""Who is here: beacons, liveliness, restarts, and two processes with one name."""

from __future__ import annotations

from dataclasses import dataclass, field

from mrslam.comms.wire.messages import Beacon

TWIN_BEACONS = 3
"""So many beacons of another process with my name prove that it lives (one may be a late echo of my own past life)."""


@dataclass
class Peer:
    """A teammate in sight."""

    boot: int = 0
    """0 until its first beacon."""
    mode: int = 0
    heard_ns: int = 0
    has_token: bool = False
    """Whether its liveliness token is up."""
    last_seq: int = -1
    pose_taken_ms: int | None = None
    """When its last pose was taken, on its own clock."""
    past_boots: tuple[int, ...] = ()


@dataclass
class TwinWatch:
    """Looks out for another process with my robot id."""

    _seen: dict[int, tuple[int, int]] = field(default_factory=dict)  # boot -> (last seq, beacons)

    def hear(self, beacon: Beacon) -> bool:
        """Take a beacon that bears my name and another boot; return True once, when it is certain."""
        last, count = self._seen.get(beacon.boot, (-1, 0))
        if beacon.seq <= last:
            return False
        if len(self._seen) > 64:
            self._seen.clear()
        self._seen[beacon.boot] = (beacon.seq, count + 1)
        return count + 1 == TWIN_BEACONS


def am_newcomer(own_uptime_ms: int, own_boot: int, other: Beacon) -> bool:
    """Return whether I am the later of two processes with one name."""
    return (own_uptime_ms, -own_boot) < (other.uptime_ms, -other.boot)
