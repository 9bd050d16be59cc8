"""When a laser gives no usable scans: reported as an event, since the robot drives on by odometry."""

from __future__ import annotations

from mrslam.agent.effects import Event

BLIND_NS = 1_000_000_000
"""Time without a usable scan, though scans come, from which a robot is blind, nanoseconds: ten scans at 10 Hz."""


class Blindness:
    """Notices that scans come, and none can be used."""

    def __init__(self) -> None:
        self._seen_ns: int | None = None
        self._blind = False

    def look(self, reason: str | None, now_ns: int) -> list[Event]:
        """Take why a scan could not be used, or None; return an event when the robot goes blind, or sees again."""
        if reason is None:
            blind_ns = 0 if self._seen_ns is None else now_ns - self._seen_ns
            was_blind, self._blind, self._seen_ns = self._blind, False, now_ns
            return [Event(now_ns, "sees", {"blind_s": round(blind_ns / 1e9, 1)})] if was_blind else []
        if self._seen_ns is None:
            self._seen_ns = now_ns
        if self._blind or now_ns - self._seen_ns < BLIND_NS:
            return []
        self._blind = True
        return [Event(now_ns, "blind", {"reason": reason})]
