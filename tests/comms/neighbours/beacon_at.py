"""Beacons of robots at a time."""

from __future__ import annotations

from mrslam.comms import (
    CommsNode,
    Send,
)
from mrslam.comms.wire.frames import team_tag

TAG = team_tag("team")


def beacon_at(node: CommsNode, now_ns: int) -> bytes:
    """Return the beacon that a node sends at this time."""
    (payload,) = [e.payload for e in node.on_tick(now_ns) if isinstance(e, Send) and e.lane == "beacon"]
    return payload
