"""A robot's status: the state of its links as values, and as the message that ``mrslam top`` shows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mrslam.comms.config import MODES
from mrslam.comms.effects import Send
from mrslam.comms.node import CommsNode
from mrslam.comms.wire.messages import LinkRow, Status, encode

MAX_ROWS = 64
"""Most links and most pairs of maps in one status (the format)."""
MAX_WORDS = 120
"""Most characters of a text in a status (the format)."""


@dataclass(frozen=True)
class PeerStatus:
    """One row of the live view."""

    peer: str
    mode: str
    quality: float
    """LQ x NLQ, 0..1."""
    lq: float
    """Share of its beacons that arrive here."""
    state: str
    """"weak" or "strong"."""
    activity: str
    """In words: "exchanging", "next exchange in 12 s", "link too weak (0.42 < 0.80)", ..."""
    next_exchange_s: float
    """Seconds to the next exchange; inf where none is due on this link."""
    failures: int
    """Failed exchanges in a row."""
    bytes_sent: int
    bytes_received: int
    bytes_saved: int
    """What whole maps, LZ4, would have cost beyond what was sent; negative where it cost more."""
    version: tuple[int, int]
    """(epoch, revision) held of its map; (0, 0) for none."""


def team_status(node: CommsNode, now_ns: int) -> list[PeerStatus]:
    """Return a row for every teammate in sight, by name."""
    return [_row(node, peer, now_ns) for peer in sorted(node.peers)]


def _row(node: CommsNode, peer: str, now_ns: int) -> PeerStatus:
    link = node.rendezvous.peers.get(peer)
    wait_s = node.rendezvous.next_exchange_s(peer, now_ns)
    totals = node.totals[peer]
    quality = 0.0 if link is None else link.quality
    if link is not None and link.is_busy:
        activity = "exchanging"
    elif link is None or link.state != 1:
        activity = f"link too weak ({quality:.2f} < {node.config.link_threshold:.2f})"
    elif link.failures:
        activity = f"exchange failed {link.failures} x, again in {wait_s:.0f} s"
    else:
        activity = f"next exchange in {wait_s:.0f} s"
    return PeerStatus(
        peer=peer,
        mode=MODES[node.peers[peer].mode],
        quality=quality,
        lq=node.links.lq(peer, now_ns),
        state="strong" if link is not None and link.state == 1 else "weak",
        activity=activity,
        next_exchange_s=wait_s,
        failures=0 if link is None else link.failures,
        bytes_sent=totals.sent,
        bytes_received=totals.received,
        bytes_saved=totals.full_lz4 - totals.sent,
        version=node.store.version(peer),
    )


def status_report(node: CommsNode, now_ns: int, alignments: Sequence[tuple[str, str, str]] = ()) -> Send:
    """Return the robot's status for watchers; ``alignments``: two robots, and in words how their maps fit."""
    links = [
        LinkRow(
            row.peer,
            round(100 * row.quality),
            round(100 * row.lq),
            row.state == "strong",
            row.activity[:MAX_WORDS],
            None if math.isinf(row.next_exchange_s) else round(1e3 * row.next_exchange_s),
            row.bytes_sent,
            row.bytes_received,
            row.bytes_saved,
        )
        for row in team_status(node, now_ns)[:MAX_ROWS]
    ]
    message = Status(
        node.robot_id,
        node.boot_id,
        node.uptime_ms(now_ns),
        MODES.index(node.mode),
        node.bytes_sent["beacon"],
        node.bytes_sent["control"] + node.bytes_sent["bulk"],
        links,
        [(robot, *version) for robot, version in node.store.digest().items()],
        [(a, b, words[:MAX_WORDS]) for a, b, words in alignments[:MAX_ROWS]],
        None if node.store.seal is None else max(round(node.store.seal.ends_s), 0),
    )
    return Send(None, encode(message, node.team_tag), "status")
