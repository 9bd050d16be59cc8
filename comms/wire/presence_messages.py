"""Messages about a robot itself: that it is here, how it is, that it leaves."""

from __future__ import annotations

from typing import Annotated

import msgspec

from mrslam.comms.wire.fields import I32, Count, Digest, Message, Milliseconds, Name, Percent


class Beacon(Message, frozen=True, tag=1):
    """I am here; I hear you this well; I stand there."""

    boot: Count
    seq: Count
    uptime_ms: Milliseconds
    """When it was sent, on the sender's clock since its start."""
    period_ms: Annotated[int, msgspec.Meta(ge=1, le=10**9)]
    mode: Annotated[int, msgspec.Meta(ge=0, le=2)]
    heard: Annotated[list[tuple[Name, Percent]], msgspec.Meta(max_length=64)]
    bumps: Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]
    """Epoch of the sender's map - boot; below 0 for a map continued from an earlier start."""
    pose: tuple[I32, I32, I32, Milliseconds] | None
    """x (mm), y (mm), theta (0.1 mrad), age (ms)."""


class Bye(Message, frozen=True, tag=10):
    """I leave."""

    boot: Count


Words = Annotated[str, msgspec.Meta(max_length=120)]
Bytes = Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]


class LinkRow(msgspec.Struct, array_like=True, frozen=True):
    """One teammate, as the sender of a :class:`Status` sees it."""

    peer: Name
    quality: Percent
    lq: Percent
    strong: bool
    activity: Words
    next_ms: Milliseconds | None
    """Until the next exchange; nil: none is due."""
    sent: Bytes
    received: Bytes
    saved: Bytes
    """What whole maps as LZ4 would have cost beyond what was sent."""


class Status(Message, frozen=True, tag=12):
    """How a robot fares, for those who watch; robots do not listen to it."""

    boot: Count
    uptime_ms: Milliseconds
    mode: Annotated[int, msgspec.Meta(ge=0, le=2)]
    beacon_bytes: Count
    """Bytes of beacons sent since the start."""
    other_bytes: Count
    """Bytes of all else sent since the start, but of statuses."""
    links: Annotated[list[LinkRow], msgspec.Meta(max_length=64)]
    digest: Digest
    """The maps it holds."""
    alignments: Annotated[list[tuple[Name, Name, Words]], msgspec.Meta(max_length=64)]
    """Pairs of maps and what is believed of them."""
    certificate_ends_s: Annotated[int, msgspec.Meta(ge=0, le=2**53)] | None = None
    """When the sender's certificate ends, seconds since 1970; nil, or left out, without keys."""
