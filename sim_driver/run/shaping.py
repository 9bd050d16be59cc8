"""A real transport made as bad as the radio: what the link would have lost is dropped on arrival."""

from __future__ import annotations

import math

import numpy as np

from mrslam.agent import Clock, LinkSource
from mrslam.comms import Incoming, PeerJoined, PeerLeft, Send, Transport

CUT_BELOW = 0.05
"""Below this quality a link carries nothing; above it, repetition brings all but beacons through."""


class ShapedTransport:
    """Wraps a transport; beacons arrive with the link's delivery ratio, and a dead link delivers nothing at all."""

    def __init__(self, inner: Transport, links: LinkSource, clock: Clock, seed: int) -> None:
        """Take the transport and what tells the qualities of its links."""
        self._inner, self._links, self._clock = inner, links, clock
        self._rng = np.random.default_rng(seed)

    def send(self, effect: Send) -> None:
        """Send as it is: the loss is at the receiver's end."""
        self._inner.send(effect)

    def poll(self, timeout_s: float) -> list[Incoming | PeerJoined | PeerLeft]:
        """Return what the radio let through."""
        items = self._inner.poll(timeout_s)
        if not items:
            return items
        qualities = self._links.qualities(self._clock.now_ns())
        return [item for item in items if not isinstance(item, Incoming) or self._passes(item, qualities)]

    def _passes(self, item: Incoming, qualities: dict[str, float]) -> bool:
        quality = 1.0 if item.sender is None else qualities.get(item.sender, 1.0)
        if quality < CUT_BELOW:
            return False
        # Quality is LQ x NLQ; one way delivers its square root.
        return item.lane != "beacon" or bool(self._rng.random() < math.sqrt(quality))

    def close(self) -> None:
        """Close the transport."""
        self._inner.close()
