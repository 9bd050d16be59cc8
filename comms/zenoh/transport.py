"""Robots over Zenoh.

Keys: ``mrslam/<team>/<robot>/all/<lane>`` to everybody, ``mrslam/<team>/<robot>/to/<peer>/<lane>`` to one,
``mrslam/<team>/<robot>/status`` to those who watch (nobody else subscribes, so without them nothing is sent), and the
liveliness token ``mrslam/<team>/<robot>/alive/<session>``. A robot publishes only below its own name, which access
rules can enforce. Zenoh's threads only put what arrives into a bounded queue.
"""

from __future__ import annotations

import logging
import time
from collections import Counter
from collections.abc import Sequence, Set
from typing import Any

import zenoh

from mrslam.comms.effects import Lane, Send
from mrslam.comms.milestones import is_milestone
from mrslam.comms.security.revocation import Revocations
from mrslam.comms.security.team_keys import RobotKeys
from mrslam.comms.transport.base import Incoming, PeerJoined, PeerLeft, TransportEvent
from mrslam.comms.transport.inbox import Inbox
from mrslam.comms.transport.local_robots import announce, withdraw
from mrslam.comms.transport.outbox import Outbox
from mrslam.comms.wire.frames import check_name
from mrslam.comms.zenoh.config import datagram_settings, settings, split_datagrams
from mrslam.comms.zenoh.session import close_session, open_session, warn_if_open
from mrslam.spatial import InputError

GOODBYE_S = 0.1
"""The last messages are given this long before the token falls, seconds: it has a higher priority, and would overtake
the goodbye."""

LOOK_S = 1.0
"""Time between two looks at the revocation list's file, seconds; each is one call of ``stat``."""

log = logging.getLogger(__name__)

LANES: tuple[Lane, ...] = ("beacon", "control", "bulk")
"""Lanes of messages between robots; ``status`` is for watchers."""


class ZenohTransport:
    """One robot's Zenoh session."""

    def __init__(
        self,
        robot_id: str,
        team: str,
        *,
        listen: Sequence[str] = (),
        connect: Sequence[str] = (),
        multicast: bool = False,
        mode: str = "peer",
        keys: RobotKeys | None = None,
    ) -> None:
        """Open the session and announce the robot.

        ``listen``, ``connect``: endpoints such as ``tcp/0.0.0.0:7447``; several are fine, absent peers are tried again;
            beacons take datagram ones, ``udp/...`` or with keys ``quic/...?rel=0``, where there are any.
        ``multicast``: find robots on the local network by themselves. ``mode``: "peer", "client", "router".
        ``keys``: the robot's certificate; then links are mutual TLS and robots publish only under their own names.
        Raises ``InputError`` where an endpoint cannot be used.
        """
        self.robot_id, self.team = check_name(robot_id, "robot id"), check_name(team, "team name")
        self.inbox = Inbox()
        self.refused: Counter[str] = Counter()
        """What revoked robots sent, by name."""
        self._root, self._own = f"mrslam/{team}", f"mrslam/{team}/{robot_id}"
        self._tokens: dict[str, set[str]] = {}  # of every robot that is here: its sessions
        self._closed = False
        self._revocations = None if keys is None else keys.revocations
        self._looked_s = 0.0
        warn_if_open(team, [*listen, *connect], multicast, keys)
        (listen, listen_datagrams), (connect, connect_datagrams) = split_datagrams(listen), split_datagrams(connect)
        self._session = open_session(
            settings(team, mode=mode, listen=listen, connect=connect, multicast=multicast, keys=keys)
        )
        self._datagrams = self._open_datagrams(listen_datagrams, connect_datagrams, keys)
        # The bulk lane has a thread of its own: a map chunk that waits must not hold up a question.
        self._control = Outbox(f"{robot_id}-control", self._put_control)
        self._bulk = Outbox(f"{robot_id}-bulk", self._put_bulk)
        self._beacons, self._status = self._declare_publishers()
        self._subscribers = self._subscribe()
        self._token = self._session.liveliness().declare_token(f"{self._own}/alive/{self._session.zid()}")
        self._announced = announce(team, robot_id, listen)

    def _open_datagrams(self, listen: Sequence[str], connect: Sequence[str], keys: RobotKeys | None) -> zenoh.Session:
        """Return the session that carries beacons: one of its own where there are datagram endpoints."""
        if not (listen or connect):
            return self._session
        try:
            return open_session(datagram_settings(self.team, listen, connect, keys))
        except InputError:
            close_session(self._session)
            raise

    def _declare_publishers(self) -> tuple[zenoh.Publisher, zenoh.Publisher]:
        """Return publishers of the beacons and of the status, which may be lost."""
        beacons = self._datagrams.declare_publisher(
            f"{self._own}/all/beacon",
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.INTERACTIVE_HIGH,
            reliability=zenoh.Reliability.BEST_EFFORT,
            express=True,
        )
        status = self._session.declare_publisher(
            f"{self._own}/status",
            congestion_control=zenoh.CongestionControl.DROP,
            priority=zenoh.Priority.DATA_LOW,
            reliability=zenoh.Reliability.BEST_EFFORT,
        )
        return beacons, status

    def _subscribe(self) -> list[Any]:
        """Return subscribers to what others send to all and to this robot, and to their liveliness tokens."""
        everyone, me, remote = f"{self._root}/*/all/*", f"{self._root}/*/to/{self.robot_id}/*", zenoh.Locality.REMOTE
        subscribers: list[Any] = [
            self._session.declare_subscriber(everyone, self._on_sample, allowed_origin=remote),
            self._session.declare_subscriber(me, self._on_sample, allowed_origin=remote),
        ]
        if self._datagrams is not self._session:
            subscribers.append(self._datagrams.declare_subscriber(everyone, self._on_sample, allowed_origin=remote))
        tokens = self._session.liveliness()
        subscribers.append(tokens.declare_subscriber(f"{self._root}/*/alive/*", self._on_token, history=True))
        return subscribers

    def send(self, effect: Send) -> None:
        """Send without waiting."""
        if self._closed:
            return
        if effect.lane == "beacon" and effect.to is None:
            self._beacons.put(effect.payload)
            return
        if effect.lane == "status":
            self._status.put(effect.payload)
            return
        target = "all" if effect.to is None else f"to/{effect.to}"
        outbox = self._bulk if effect.lane == "bulk" else self._control
        outbox.send(f"{self._own}/{target}/{effect.lane}", effect.payload)

    def poll(self, timeout_s: float) -> list[TransportEvent]:
        """Return what arrived; wait at most ``timeout_s`` for the first."""
        arrivals = self.inbox.take(timeout_s)
        if self._revocations is None:
            return arrivals
        return [*self._newly_revoked(self._revocations), *without(arrivals, self._revocations.names, self.refused)]

    def _newly_revoked(self, revocations: Revocations) -> list[TransportEvent]:
        """Read the revocation list again, where it is time; return a ``PeerLeft`` for each name added."""
        now_s = time.monotonic()
        if now_s - self._looked_s < LOOK_S:
            return []
        self._looked_s = now_s
        return [PeerLeft(name) for name in sorted(revocations.refresh())]

    def links(self) -> int:
        """Return how many other Zenoh nodes this one is connected to."""
        info = self._session.info
        return len(info.peers_zid()) + len(info.routers_zid())

    def close(self) -> None:
        """Leave the network: teammates see it at once."""
        if self._closed:
            return
        self._closed = True
        withdraw(self._announced)
        self._control.close()
        self._bulk.close()
        time.sleep(GOODBYE_S)
        close_session(self._session, (self._token, *self._subscribers, self._beacons, self._status))
        if self._datagrams is not self._session:
            close_session(self._datagrams)

    def _put_control(self, key: str, payload: bytes) -> None:
        self._session.put(
            key,
            payload,
            congestion_control=zenoh.CongestionControl.BLOCK,
            priority=zenoh.Priority.DATA_HIGH,
            express=True,
        )

    def _put_bulk(self, key: str, payload: bytes) -> None:
        self._session.put(
            key, payload, congestion_control=zenoh.CongestionControl.BLOCK, priority=zenoh.Priority.BACKGROUND
        )

    # -- on Zenoh's threads: look at the key, put into a queue, nothing else ---------------------------------------

    def _on_sample(self, sample: zenoh.Sample) -> None:
        parts = str(sample.key_expr).split("/")
        lane = parts[-1]
        if len(parts) < 5 or lane not in LANES or sample.kind != zenoh.SampleKind.PUT:
            return
        self.inbox.put(Incoming(sample.payload.to_bytes(), parts[2], lane))

    def _on_token(self, sample: zenoh.Sample) -> None:
        parts = str(sample.key_expr).split("/")
        if len(parts) != 5 or parts[2] == self.robot_id:
            return
        peer, session = parts[2], parts[4]
        if sample.kind == zenoh.SampleKind.PUT:
            tokens = self._tokens.setdefault(peer, set())
            tokens.add(session)
            if len(tokens) == 1:
                self.inbox.put(PeerJoined(peer))
        elif session in (tokens := self._tokens.get(peer, set())):
            tokens.remove(session)
            if not tokens:
                del self._tokens[peer]
                self.inbox.put(PeerLeft(peer))


def without(arrivals: list[TransportEvent], revoked: Set[str], refused: Counter[str]) -> list[TransportEvent]:
    """Return the arrivals that are not from revoked robots; those are counted in ``refused``, by name."""
    if not revoked:
        return arrivals
    kept: list[TransportEvent] = []
    for item in arrivals:
        sender = item.sender if isinstance(item, Incoming) else item.peer
        if sender in revoked:
            refused[str(sender)] += 1
            if is_milestone(count := refused[str(sender)]):
                log.warning("%d messages of %s were not taken: it is revoked", count, sender)
        else:
            kept.append(item)
    return kept
