"""What all parts of the network core share: who this robot is, what it knows, and how it sends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mrslam.comms.config import CommsConfig
from mrslam.comms.exchange.outgoing import Outgoing
from mrslam.comms.exchange.rendezvous import Rendezvous
from mrslam.comms.maps.arrivals import Arrivals
from mrslam.comms.maps.store import MapStore


@dataclass(frozen=True)
class Station:
    """One robot's identity, settings, maps and line out. Nothing in it does I/O."""

    own_id: str
    boot: int
    mode: str
    config: CommsConfig
    store: MapStore
    arrivals: Arrivals
    rendezvous: Rendezvous
    out: Outgoing
    takes_maps: Callable[[str], bool]
    """Whether a peer takes maps at all."""
