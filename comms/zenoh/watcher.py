"""Watching robots over Zenoh: subscribes to statuses and liveliness tokens, and publishes nothing."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from typing import Any

import zenoh

from mrslam.comms.security.team_keys import RobotKeys
from mrslam.comms.transport.base import Sighting
from mrslam.comms.wire.frames import check_name
from mrslam.comms.zenoh.config import watcher_settings
from mrslam.comms.zenoh.session import close_session, open_session, warn_if_open

MAX_SIGHTINGS = 4096
"""Sightings kept between two polls; the oldest are lost. Bounds memory alone."""


class ZenohWatcher:
    """Receives statuses and presence; is seen by no robot, and listens on no address unless asked to."""

    def __init__(
        self,
        team: str | None,
        *,
        listen: Sequence[str] = (),
        connect: Sequence[str] = (),
        multicast: bool = False,
        keys: RobotKeys | None = None,
    ) -> None:
        """Watch one team, or all that can be reached; raises ``InputError`` where an endpoint cannot be used."""
        pattern = "*" if team is None else check_name(team, "team name")
        warn_if_open(pattern, [*listen, *connect], multicast, keys)
        self._session = open_session(watcher_settings(pattern, listen, connect, multicast, keys))
        self._seen: deque[Sighting] = deque(maxlen=MAX_SIGHTINGS)
        liveliness = self._session.liveliness()
        self._subscribers: list[Any] = [
            self._session.declare_subscriber(f"mrslam/{pattern}/*/status", self._on_status),
            liveliness.declare_subscriber(f"mrslam/{pattern}/*/alive/*", self._on_token, history=True),
        ]

    def poll(self) -> list[Sighting]:
        """Return what was seen since the last call."""
        seen = []
        while self._seen:
            seen.append(self._seen.popleft())
        return seen

    def close(self) -> None:
        """Stop watching."""
        close_session(self._session, self._subscribers)

    def _on_status(self, sample: zenoh.Sample) -> None:
        parts = str(sample.key_expr).split("/")
        if len(parts) == 4 and sample.kind == zenoh.SampleKind.PUT:
            self._seen.append(Sighting(parts[1], parts[2], sample.payload.to_bytes()))

    def _on_token(self, sample: zenoh.Sample) -> None:
        parts = str(sample.key_expr).split("/")
        if len(parts) == 5:
            self._seen.append(Sighting(parts[1], parts[2], None, sample.kind == zenoh.SampleKind.PUT))
