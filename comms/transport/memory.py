"""A network in memory, on virtual time: loss, delay, duplication, reordering, bandwidth, partition and crash, seeded.

One seed gives the same arrivals on every run, as long as the calls are the same.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from mrslam.comms.effects import Send
from mrslam.comms.transport.base import Incoming, PeerJoined, PeerLeft, TransportEvent


@dataclass(frozen=True, kw_only=True)
class LinkConditions:
    """How one direction of a link treats messages."""

    loss: float = 0.0
    """Share of messages lost, 0..1; 1: no link."""
    delay_s: float = 0.001
    """Time on the way, seconds."""
    jitter_s: float = 0.0
    """Random time added, seconds; larger than the gap between messages it reorders them."""
    duplicate: float = 0.0
    """Share of messages that arrive twice, 0..1."""
    rate_bps: float = math.inf
    """Bits per second; messages queue for it."""

    @classmethod
    def of_quality(cls, quality: float) -> LinkConditions:
        """Return the loss at which beacons measure this quality: LQ x NLQ = (1 - loss)^2."""
        return cls(loss=1.0 - math.sqrt(min(max(quality, 0.0), 1.0)))


PERFECT = LinkConditions()
Conditions = Callable[[str, str, int], LinkConditions]
"""(sender, receiver, now_ns) -> conditions of that direction of the link."""

RETRANSMIT_S = 0.2
"""Time that one loss costs on a reliable lane, seconds: the least retransmission timeout of Linux' TCP."""
TWIN = "+twin"
"""Added to the name of a second process with one robot id."""
LEASE_NS = 2_000_000_000
"""A crashed robot's token falls after this, nanoseconds, as over Zenoh (``zenoh.config.LEASE_MS``)."""


class MemoryNetwork:
    """All robots' links; the caller moves time."""

    def __init__(
        self, seed: int = 0, conditions: Conditions | None = None, *, reliable: bool = True, queue_s: float = 10.0
    ) -> None:
        """Make an empty network.

        ``reliable``: maps and control messages arrive in order, losses only delay them (as over TCP); False: they are
        lost, doubled and reordered like beacons. ``queue_s``: what would wait longer for a slow link is lost, seconds.
        """
        self.now_ns = 0
        self.conditions: Conditions = conditions or (lambda a, b, now_ns: PERFECT)
        self._rng = np.random.default_rng(seed)
        self._reliable, self._queue_s = reliable, queue_s
        self._ends: dict[str, MemoryTransport] = {}
        self._events: list[tuple[int, int, str, MemoryTransport | None, TransportEvent]] = []
        self._count = 0
        self._free_ns: dict[tuple[str, str], int] = {}
        self._last_ns: dict[tuple[str, str], int] = {}

    def attach(self, robot_id: str, *, twin: bool = False) -> MemoryTransport:
        """Return a robot's end; all others see it join. A ``twin`` is a second process with the same robot id."""
        end = MemoryTransport(self, robot_id, robot_id + TWIN * twin)
        for name, other in self._ends.items():
            self._push(self.now_ns, name, None, PeerJoined(robot_id))
            self._push(self.now_ns, end.name, end, PeerJoined(other.robot_id))
        self._ends[end.name] = end
        return end

    def advance(self, now_ns: int) -> None:
        """Move time on; what is due at ``now_ns`` can be polled."""
        while self._events and self._events[0][0] <= now_ns:
            self.now_ns, _, receiver, end, arrival = heapq.heappop(self._events)
            target = self._ends.get(receiver)
            if target is not None and (end is None or end is target):
                target.inbox.append(arrival)
        self.now_ns = max(self.now_ns, now_ns)

    @property
    def queued(self) -> int:
        """How many messages are on their way."""
        return len(self._events)

    def crash(self, robot_id: str) -> None:
        """Take a robot off the network without a goodbye; its token falls when the lease is over."""
        if self._ends.pop(robot_id, None) is not None:
            self._announce_leave(robot_id, LEASE_NS)

    def leave(self, end: MemoryTransport) -> None:
        """Take a robot off the network in good order."""
        if self._ends.get(end.name) is end:
            del self._ends[end.name]
            if all(other.robot_id != end.robot_id for other in self._ends.values()):
                self._announce_leave(end.robot_id, 0)

    def _announce_leave(self, robot_id: str, after_ns: int) -> None:
        for name, other in self._ends.items():
            said_ns = self._last_ns.get((robot_id, other.robot_id), 0)  # its goodbye comes first
            self._push(max(self.now_ns + after_ns, said_ns), name, None, PeerLeft(robot_id))

    def carry(self, end: MemoryTransport, effect: Send) -> None:
        """Put a message on its way."""
        if self._ends.get(end.name) is not end or effect.lane == "status":  # nobody watches
            return
        for name, other in list(self._ends.items()):
            if name != end.name and effect.to in (None, other.robot_id):
                self._carry_one(end.robot_id, name, other.robot_id, effect)

    def _carry_one(self, sender: str, name: str, receiver: str, effect: Send) -> None:
        link = self.conditions(sender, receiver, self.now_ns)
        if link.loss >= 1.0:
            return
        reliable = self._reliable and effect.lane != "beacon"
        depart_ns = self.now_ns
        if math.isfinite(link.rate_bps):
            start_ns = max(self._free_ns.get((sender, receiver), 0), self.now_ns)
            if start_ns - self.now_ns > self._queue_s * 1e9:
                return
            depart_ns = start_ns + round(len(effect.payload) * 8e9 / link.rate_bps)
            self._free_ns[sender, receiver] = depart_ns
        arrive_ns = depart_ns + round((link.delay_s + link.jitter_s * self._rng.random()) * 1e9)
        lost = self._rng.random() < link.loss
        while reliable and lost:
            arrive_ns += round(RETRANSMIT_S * 1e9)
            lost = self._rng.random() < link.loss
        if lost:
            return
        if reliable:
            arrive_ns = self._last_ns[sender, receiver] = max(arrive_ns, self._last_ns.get((sender, receiver), 0))
        arrival = Incoming(effect.payload, sender, effect.lane)
        self._push(arrive_ns, name, None, arrival)
        if not reliable and self._rng.random() < link.duplicate:
            self._push(arrive_ns + round(link.jitter_s * self._rng.random() * 1e9), name, None, arrival)

    def _push(self, at_ns: int, receiver: str, end: MemoryTransport | None, arrival: TransportEvent) -> None:
        self._count += 1
        heapq.heappush(self._events, (at_ns, self._count, receiver, end, arrival))


class MemoryTransport:
    """One robot's end of a :class:`MemoryNetwork`."""

    def __init__(self, network: MemoryNetwork, robot_id: str, name: str) -> None:
        """Made by :meth:`MemoryNetwork.attach`."""
        self.robot_id, self.name = robot_id, name
        self.inbox: list[TransportEvent] = []
        self._network = network

    def send(self, effect: Send) -> None:
        """Put a message on its way."""
        self._network.carry(self, effect)

    def poll(self, timeout_s: float = 0.0) -> list[TransportEvent]:
        """Return what has arrived by the network's present time; never waits."""
        arrived, self.inbox = self.inbox, []
        return arrived

    def close(self) -> None:
        """Leave the network; teammates see it at once."""
        self._network.leave(self)
