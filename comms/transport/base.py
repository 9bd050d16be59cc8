"""The interface of a transport, and what it delivers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from mrslam.comms.effects import Lane, Send


@dataclass(frozen=True)
class Incoming:
    """Bytes that arrived."""

    payload: bytes
    sender: str | None
    """Who sent it, as far as the transport knows."""
    lane: Lane


@dataclass(frozen=True)
class PeerJoined:
    """A robot's liveliness token is up."""

    peer: str


@dataclass(frozen=True)
class PeerLeft:
    """A robot's liveliness token is gone."""

    peer: str


TransportEvent = Incoming | PeerJoined | PeerLeft
"""What a transport delivers, in order."""


@dataclass(frozen=True)
class Sighting:
    """A status, or a change of presence, that a watcher received from one robot."""

    team: str
    robot: str
    payload: bytes | None
    """Its status as sent; None where only its presence changed."""
    is_here: bool = True


class Transport(Protocol):
    """One robot's end of a network."""

    def send(self, effect: Send) -> None:
        """Send without waiting; what cannot be sent is lost, as on a radio."""

    def poll(self, timeout_s: float) -> list[TransportEvent]:
        """Return what arrived, in order; wait at most ``timeout_s`` for the first."""

    def close(self) -> None:
        """Leave the network. Closing twice does no harm."""
