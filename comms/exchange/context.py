"""What all parts of :class:`mrslam.comms.CommsNode` share: identity, settings, maps, outgoing messages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mrslam.comms.config import CommsConfig
from mrslam.comms.exchange.outgoing import Outgoing
from mrslam.comms.exchange.rendezvous import Rendezvous
from mrslam.comms.maps.staged_maps import StagedMaps
from mrslam.comms.maps.store import MapStore


@dataclass(frozen=True)
class ExchangeContext:
    """One robot's end of the network, of any mode (not a base station). Nothing in it does I/O."""

    own_id: str
    boot: int
    mode: str
    """One of ``MODES``."""
    config: CommsConfig
    store: MapStore
    staged_maps: StagedMaps
    rendezvous: Rendezvous
    out: Outgoing
    takes_maps: Callable[[str], bool]
    """Whether a peer takes maps at all."""

    @property
    def shares_saved_maps(self) -> bool:
        """Whether this robot gives saved maps to teammates and takes theirs: one that maps and merges, by default."""
        return self.config.share_saved_maps and self.mode == "distributed"
