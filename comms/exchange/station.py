"""What all sides of an exchange work with: who this robot is, what it knows, and how it speaks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mrslam.comms.config import CommsConfig
from mrslam.comms.effects import Effect, Lane
from mrslam.comms.exchange.rendezvous import Rendezvous
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.messages import Message

Post = Callable[[Message, str | None, Lane], int]
"""Sends a message to a peer (None: to all) and returns its size, bytes."""


@dataclass(frozen=True)
class Station:
    """One robot's means. Nothing in it does I/O."""

    own_id: str
    boot: int
    mode: str
    config: CommsConfig
    store: MapStore
    rendezvous: Rendezvous
    post: Post
    emit: Callable[[Effect], None]
    """Tells the shell."""
    takes_maps: Callable[[str], bool]
    """Whether a peer wants any maps."""
