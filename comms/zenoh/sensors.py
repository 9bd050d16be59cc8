"""Scans and odometry from a robot's own drivers over Zenoh, on the robot alone: never on the radio.

Keys: ``mrslam/<team>/<robot>/scan`` and ``.../odom``. The agent listens for them on an address of its own.
"""

from __future__ import annotations

import logging
from collections import Counter
from collections.abc import Callable, Sequence

import zenoh

from mrslam.comms.milestones import is_milestone
from mrslam.comms.transport.sensors import decode_odometry, decode_scan, encode_odometry, encode_scan
from mrslam.comms.wire.frames import check_name
from mrslam.comms.zenoh.config import check_endpoint
from mrslam.comms.zenoh.session import close_session, open_session
from mrslam.spatial import InputError, Scan
from mrslam.spatial.se2 import Transform

log = logging.getLogger(__name__)


def _settings(listen: Sequence[str], connect: Sequence[str]) -> dict[str, object]:
    for endpoint in (*listen, *connect):
        check_endpoint(endpoint)
    return {
        "mode": "peer",
        "scouting/multicast/enabled": False,
        "scouting/gossip/enabled": False,
        "listen/endpoints": list(listen),
        "connect/endpoints": list(connect),
        "connect/timeout_ms": -1,
        "connect/exit_on_failure": False,
    }


class ZenohSensors:
    """The agent's end: hands every scan and every odometry reading to a function, on Zenoh's threads."""

    def __init__(
        self,
        robot_id: str,
        team: str,
        listen: str,
        on_scan: Callable[[Scan, Transform | None], None],
        on_odometry: Callable[[int, Transform], None],
    ) -> None:
        """Listen; raises ``InputError`` where the address cannot be used."""
        root = f"mrslam/{check_name(team, 'team name')}/{check_name(robot_id, 'robot id')}"
        self.dropped: Counter[str] = Counter()
        """Bad messages, by kind: "scan" or "odometry"."""
        self._session = open_session(_settings([listen], []))
        self._subscribers = [
            self._session.declare_subscriber(
                f"{root}/scan", self._guarded("scan", lambda raw: on_scan(*decode_scan(raw)))
            ),
            self._session.declare_subscriber(
                f"{root}/odom", self._guarded("odometry", lambda raw: on_odometry(*decode_odometry(raw)))
            ),
        ]

    def _guarded(self, kind: str, take: Callable[[bytes], None]) -> Callable[[zenoh.Sample], None]:
        def on_sample(sample: zenoh.Sample) -> None:
            try:
                take(sample.payload.to_bytes())
            except InputError as error:
                self.dropped[kind] += 1
                if is_milestone(count := self.dropped[kind]):
                    log.warning("%d messages (%s) of a driver were dropped, the last: %s", count, kind, error)

        return on_sample

    def close(self) -> None:
        """Stop listening."""
        close_session(self._session, self._subscribers)


class SensorPublisher:
    """A driver's end, in Python: gives an agent its scans."""

    def __init__(self, robot_id: str, team: str, connect: str) -> None:
        """Connect to the agent's sensor address; it may come up later."""
        root = f"mrslam/{check_name(team, 'team name')}/{check_name(robot_id, 'robot id')}"
        self._session = open_session(_settings([], [connect]))
        options = {"congestion_control": zenoh.CongestionControl.DROP, "express": True}
        self._scan = self._session.declare_publisher(f"{root}/scan", **options)  # type: ignore[arg-type]
        self._odometry = self._session.declare_publisher(f"{root}/odom", **options)  # type: ignore[arg-type]

    def scan(self, scan: Scan, T_odom_base: Transform | None = None) -> None:
        """Give a scan, with the odometry of that moment where it is known."""
        self._scan.put(encode_scan(scan, T_odom_base))

    def odometry(self, stamp_ns: int, T_odom_base: Transform) -> None:
        """Give an odometry reading."""
        self._odometry.put(encode_odometry(stamp_ns, T_odom_base))

    def close(self) -> None:
        """Disconnect."""
        close_session(self._session)
