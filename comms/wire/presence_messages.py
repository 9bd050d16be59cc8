"""Messages about a robot itself: beacon, goodbye, status."""

from __future__ import annotations

from typing import Annotated

import msgspec

from mrslam.comms.effects import EPOCHS
from mrslam.comms.wire.fields import I32, Count, Digest, MapName, Message, Milliseconds, Name, Percent, SavedName

Centimetres = Annotated[int, msgspec.Meta(ge=-(2**15), le=2**15 - 1)]
Body = tuple[Centimetres, Centimetres]
"""x and y of a body that the sender saw from its pose, in its base frame."""
Claim = tuple[Name, I32, I32, I32, Annotated[int, msgspec.Meta(ge=-(2**15), le=2**15 - 1)]]
"""(robot, T_sender_robot: x (mm), y (mm), theta (0.1 mrad), what the sender's sightings say of it: 0.1 nats)."""
Epoch = Annotated[int, msgspec.Meta(ge=0, lt=EPOCHS)]
"""Epoch of a robot's map, modulo ``EPOCHS``."""
Hint = tuple[Name, I32, I32, I32]
"""(robot, T_sender_robot: x (mm), y (mm), theta (0.1 mrad)), as the sender found it by their maps."""
SavedHint = tuple[SavedName, I32, I32, I32]
"""(saved map, T_sender_saved: x (mm), y (mm), theta (0.1 mrad)), where the sender is sure that its own map lies."""


class BeaconAlone(Message, frozen=True, tag=1):
    """Announces the sender, the LQ of its neighbours, and its pose; a :class:`Beacon` without sightings is sent so."""

    boot: Count
    """Number of this start of the robot, see ``CommsNode``."""
    seq: Count
    """Number of this beacon since the start."""
    uptime_ms: Milliseconds
    """When it was sent, on the sender's clock since its start."""
    period_ms: Annotated[int, msgspec.Meta(ge=1, le=10**9)]
    """Until the next one."""
    mode: Annotated[int, msgspec.Meta(ge=0, le=2)]
    """Index in ``MODES``."""
    heard: Annotated[list[tuple[Name, Percent]], msgspec.Meta(max_length=64)]
    """(neighbour, LQ in percent) of those whose turn it is."""
    epoch_offset: Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]
    """Epoch of the sender's map - boot; below 0 for a map continued from an earlier start."""
    pose: tuple[I32, I32, I32, Milliseconds] | None
    """x (mm), y (mm), theta (0.1 mrad), age (ms)."""

    @property
    def epoch(self) -> int:
        """Epoch of the sender's map."""
        return self.boot + self.epoch_offset


class Beacon(BeaconAlone, frozen=True, tag=1):
    """A beacon with what the sender saw and found; all may be left out, and older programs pass over them."""

    bodies: Annotated[tuple[Body, ...], msgspec.Meta(max_length=8)] = ()
    """What may be a teammate, seen from the pose."""
    claims: Annotated[tuple[Claim, ...], msgspec.Meta(max_length=8)] = ()
    """Where other robots' maps may lie in the sender's, and how well that fits what it saw of them."""
    hints: Annotated[tuple[Hint, ...], msgspec.Meta(max_length=8)] = ()
    """Where the sender found other robots' maps in its own, for others to look there first."""
    claimed: Annotated[tuple[Epoch, ...], msgspec.Meta(max_length=8)] = ()
    """For each of the claims, which of that robot's maps it is about."""
    saved_hints: Annotated[tuple[SavedHint, ...], msgspec.Meta(max_length=8)] = ()
    """Where saved maps lie in the sender's own."""

    def shortest(self) -> Message:
        """Return what is sent: without the last five fields where they are empty."""
        return self if self.bodies or self.claims or self.hints or self.saved_hints else self.alone()

    def alone(self) -> BeaconAlone:
        """Return the beacon without sightings and hints."""
        return BeaconAlone(*(getattr(self, name) for name in BeaconAlone.__struct_fields__))


class Bye(Message, frozen=True, tag=10):
    """Announces that the sender leaves."""

    boot: Count


Words = Annotated[str, msgspec.Meta(max_length=120)]
Bytes = Annotated[int, msgspec.Meta(ge=-(2**62), le=2**62)]
"""Signed: what was saved may be negative."""


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
    """A robot's state, for watchers; robots ignore it."""

    boot: Count
    uptime_ms: Milliseconds
    mode: Annotated[int, msgspec.Meta(ge=0, le=2)]
    beacon_bytes: Count
    """Bytes of beacons sent since the start."""
    other_bytes: Count
    """Bytes sent since the start on the control and bulk lanes."""
    links: Annotated[list[LinkRow], msgspec.Meta(max_length=64)]
    digest: Digest
    """The maps it holds."""
    alignments: Annotated[list[tuple[MapName, MapName, Words]], msgspec.Meta(max_length=64)]
    """(map, map, state of their alignment); a map is a robot's or a saved one."""
    certificate_ends_s: Annotated[int, msgspec.Meta(ge=0, le=2**53)] | None = None
    """When the sender's certificate ends, seconds since 1970; nil, or left out, without keys."""
