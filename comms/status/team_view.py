"""A watcher's view of teams: the newest status of every robot. No I/O."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

from mrslam.comms.config import MODES
from mrslam.comms.transport.base import Sighting
from mrslam.comms.wire.frames import WireError, team_tag
from mrslam.comms.wire.messages import LinkRow, Status, decode

MAX_STATUS_BYTES = 65_536
"""A status of 64 links, 64 alignments and 256 maps takes under 40 kB."""
MAX_SHOWN = 512
"""Robots remembered at once; bounds memory alone."""


@dataclass
class _Robot:
    status: Status | None = None
    heard_s: float = 0.0
    is_here: bool = True


@dataclass
class TeamView:
    """Robots by team and name."""

    dropped: Counter[str] = field(default_factory=Counter)
    """Bad messages, by what was bad; those of robots for whom there was no room as "too many robots"."""
    _robots: dict[tuple[str, str], _Robot] = field(default_factory=dict)
    """Who came or left last is last."""

    def take(self, sightings: Iterable[Sighting], now_s: float) -> None:
        """Take what a watcher received; ``now_s``: monotonic clock, seconds."""
        for seen in sightings:
            try:
                status = None if seen.payload is None else _status(seen, seen.payload)
            except WireError as error:
                self.dropped[error.kind] += 1
                continue
            key = (seen.team, seen.robot)
            if key not in self._robots and not self._makes_room():
                self.dropped["too many robots"] += 1
            elif status is not None:
                self._robots[key] = _Robot(status, now_s)
            else:
                robot = self._robots.pop(key, _Robot())
                self._robots[key] = replace(robot, is_here=seen.is_here)

    def _makes_room(self) -> bool:
        """Return whether another robot can be remembered; where need be, the one that left first is forgotten."""
        if len(self._robots) < MAX_SHOWN:
            return True
        gone = next((key for key, robot in self._robots.items() if not robot.is_here), None)
        if gone is None:
            return False
        del self._robots[gone]
        return True

    def is_complete(self) -> bool:
        """Return whether any robot is here, and the status of all that are has come."""
        here = [robot for robot in self._robots.values() if robot.is_here]
        return bool(here) and all(robot.status is not None for robot in here)

    def snapshot(self, now_s: float) -> list[dict[str, Any]]:
        """Return a plain JSON value for every robot, by team and name."""
        return [_plain(*key, self._robots[key], now_s) for key in sorted(self._robots)]


def _status(seen: Sighting, payload: bytes) -> Status:
    """Return the status that a robot sent; raise ``WireError`` where it is none of its own."""
    message = decode(payload, team_tag(seen.team), MAX_STATUS_BYTES)
    if not isinstance(message, Status) or message.sender != seen.robot:
        raise WireError("misattributed")
    return message


def _plain(team: str, name: str, robot: _Robot, now_s: float) -> dict[str, Any]:
    row: dict[str, Any] = {"team": team, "robot": name, "here": robot.is_here}
    status = robot.status
    if status is None:
        return row | {"status": None}
    return row | {
        "status": {
            "age_s": round(now_s - robot.heard_s, 1),
            "mode": MODES[status.mode],
            "up_s": round(status.uptime_ms / 1e3, 1),
            "beacon_bytes": status.beacon_bytes,
            "exchange_bytes": status.other_bytes,
            "links": [_link(link) for link in status.links],
            "maps": {robot_id: {"epoch": epoch, "revision": revision} for robot_id, epoch, revision in status.digest},
            "certificate_ends_s": status.certificate_ends_s,
            "alignments": [{"a": a, "b": b, "words": words} for a, b, words in status.alignments],
        }
    }


def _link(link: LinkRow) -> dict[str, Any]:
    return {
        "peer": link.peer,
        "quality": link.quality / 100,
        "lq": link.lq / 100,
        "state": "strong" if link.strong else "weak",
        "activity": link.activity,
        "next_exchange_s": None if link.next_ms is None else link.next_ms / 1e3,
        "bytes_sent": link.sent,
        "bytes_received": link.received,
        "bytes_saved": link.saved,
    }
