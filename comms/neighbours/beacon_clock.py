"""When the next own beacon is due."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.comms.config import CommsConfig


@dataclass
class BeaconClock:
    """Paces the beacons: seldom while all is calm, at the full rate where links come, go or lose."""

    config: CommsConfig
    seq: int = 0
    _due_ns: int | None = None
    _sent_ns: int = 0
    _was_calm: bool = False

    def is_due(self, now_ns: int, *, calm: bool) -> bool:
        """Return whether to send a beacon now; where the calm ends, the full rate holds at once."""
        if self._due_ns is None:
            return True
        if self._was_calm and not calm:
            self._was_calm = False
            self._due_ns = min(self._due_ns, self._sent_ns + self._period_ns(False))
        return now_ns >= self._due_ns

    def next(self, now_ns: int, *, calm: bool) -> int:
        """Count a beacon that is sent now, and return in how many nanoseconds the next one follows."""
        period_ns = self._period_ns(calm)
        # On a lattice, so that the pace does not depend on when ticks come; after a stall the lattice starts again.
        due_ns = now_ns if self._due_ns is None else self._due_ns
        self._due_ns = due_ns + period_ns if now_ns - due_ns < period_ns else now_ns + period_ns
        self._sent_ns, self._was_calm = now_ns, calm
        self.seq += 1
        return period_ns

    def _period_ns(self, calm: bool) -> int:
        return round(self.config.beacon_period_s * 1e9 * (self.config.beacon_calm_factor if calm else 1.0))
