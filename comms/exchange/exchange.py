"""The state of one exchange with one peer: what was asked for, what is still to come, what it cost."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

from mrslam.comms.config import CommsConfig
from mrslam.comms.effects import ExchangeCosts
from mrslam.comms.exchange.in_flight import InFlight
from mrslam.comms.exchange.pull import Offer, Pull, offer_of
from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.maps.whole_sizes import WholeSizes
from mrslam.comms.wire.messages import Manifest, Version

MAX_OFFERED = 1024
"""Manifests one exchange remembers: four for each of ``max_robots`` maps at its default; bounds memory alone."""


@dataclass
class Exchange:
    """Both sides of one meeting, as one robot sees it."""

    peer: str
    xid: int
    opened_by_me: bool
    started_ns: int
    progress_ns: int
    """When the peer's last message of this exchange came, whatever it brought."""
    accepted: bool = False
    """Whether both digests are known."""
    theirs: dict[str, Version] = field(default_factory=dict)
    """Versions that the peer held when the exchange began, by robot; less those no longer expected from it."""
    pulls: dict[str, Pull] = field(default_factory=dict)
    """Maps being received, by robot."""
    offered: OrderedDict[Offer, Manifest] = field(default_factory=OrderedDict)
    """Manifests sent to the peer."""
    in_flight: dict[Offer, InFlight] = field(default_factory=dict)
    """Which items of those manifests were sent."""
    useful_ns: int = 0
    """When the exchange last progressed: items arrived here or there, or were sent; other messages do not count."""
    asked_ns: int = 0
    """When the open questions were last repeated."""
    retries: int = 0
    """Repeats since the peer's last message."""
    is_done: bool = False
    """Whether I have sent Done: I hold what I wanted."""
    peer_done: bool = False
    """Whether the peer has."""
    skips_done: bool = False
    """Whether to ignore the peer's next Done: a manifest that makes it want more is still on its way to it."""
    broken: str = ""
    """Why it cannot continue."""
    claim: Version | None = None
    """The version of the own map that the peer claims to hold and has yet to prove."""
    shown: Version | None = None
    """The version held of the peer's own map when this robot's first digest was sent to it."""
    budget_spent: bool = False
    """Whether either side gives no more chunks in this exchange."""
    bytes_sent: int = 0
    bytes_received: int = 0
    served: int = 0
    """Bytes of chunks sent."""
    tiles: int = 0
    """Tiles received."""
    whole: dict[str, Snapshot] = field(default_factory=dict)
    """Snapshots offered, by robot: ``costs`` compares with sending them whole."""

    def offer(self, manifest: Manifest) -> None:
        """Remember a manifest that was given, for the requests that refer to it."""
        self.offered[offer_of(manifest)] = manifest
        while len(self.offered) > MAX_OFFERED:
            self.in_flight.pop(self.offered.popitem(last=False)[0], None)

    def costs(self, sizes: WholeSizes, now_ns: int) -> ExchangeCosts:
        """Return the costs so far; ``sizes`` : remembers what the maps it offered cost whole."""
        whole = [sizes.of(robot, snapshot.map) for robot, snapshot in self.whole.items()]
        lz4, raw = sum(size for size, _ in whole), sum(size for _, size in whole)
        seconds = (now_ns - self.started_ns) / 1e9
        return ExchangeCosts(self.bytes_sent, self.bytes_received, lz4, raw, self.tiles, seconds)

    def retry_ns(self, config: CommsConfig) -> int:
        """Return the silence after which to ask again: 1, 2, then 4 times ``retry_s``."""
        return round(config.retry_s * 1e9) << min(self.retries, 2)
