"""Effects: what :class:`mrslam.comms.CommsNode` returns for the shell to send or to report."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from mrslam.spatial import LocalMap
from mrslam.spatial.tiles import TileIndex

EPOCHS = 2**16
"""Epochs of one robot are told apart in claims by their last 16 bits: those of a robot count up by one."""
Lane = Literal["beacon", "control", "bulk", "status"]
"""beacon: best effort, may be dropped; control: small and urgent; bulk: map chunks, behind all else; status: for
watchers, best effort, and sent only where there are any."""


@dataclass(frozen=True)
class Send:
    """Bytes for a peer, or for all where ``to`` is None."""

    to: str | None
    payload: bytes
    lane: Lane


@dataclass(frozen=True)
class PeerSeen:
    """A teammate came into sight."""

    peer: str
    boot_id: int
    mode: str


@dataclass(frozen=True)
class PeerGone:
    """A teammate left, or has been silent for too long."""

    peer: str
    reason: str


@dataclass(frozen=True)
class LinkChanged:
    """The quality of a link moved by at least the recorded step, or its state changed."""

    peer: str
    quality: float
    """LQ x NLQ, 0..1."""
    state: int
    """0 weak, 1 strong (of the three states in Martins 2013, section 3.3; -1, the robot itself, is never reported)."""


@dataclass(frozen=True)
class ExchangeStarted:
    """An exchange with a peer began: both have agreed. Exactly one ExchangeDone or ExchangeFailed follows.

    Reports count a robot's exchanges by ExchangeDone alone.
    """

    peer: str
    opened_by_me: bool
    unplaced: tuple[str, ...] = ()
    """Robots whose maps the peer holds and has not placed, as it says."""


@dataclass(frozen=True)
class ExchangeCosts:
    """What one exchange cost this robot, and what sending the same maps whole would have cost it."""

    bytes_sent: int
    bytes_received: int
    bytes_full_lz4: int
    """The maps whole, as LZ4 of the cropped grid."""
    bytes_full_raw: int
    """The maps whole and uncompressed."""
    tiles: int
    """Tiles received."""
    seconds: float


@dataclass(frozen=True)
class ExchangeDone:
    """Both sides hold what the other had when it began (or the bytes allowed for one meeting are spent)."""

    peer: str
    costs: ExchangeCosts
    reason: str
    """"complete", or "budget spent"."""


@dataclass(frozen=True)
class ExchangeFailed:
    """An exchange broke off. What arrived is kept, and the next one continues from there."""

    peer: str
    costs: ExchangeCosts
    reason: str


@dataclass(frozen=True)
class MapUpdated:
    """A newer snapshot of a robot's map arrived whole, or the own one was published."""

    robot_id: str
    epoch: int
    revision: int
    changed: tuple[TileIndex, ...]
    """(row, column) of the tiles that changed since the version held before; empty for the own map."""
    source: str
    """The peer it came from: the robot itself, or a third party."""
    map: LocalMap = field(repr=False)
    """The map as every robot that holds this version knows it."""


@dataclass(frozen=True, eq=False)
class TeammatePose:
    """Where a teammate says it is, in the frame of its own map."""

    peer: str
    stamp_ns: int
    """When it was there, on my clock."""
    T_map_base: NDArray[np.float64]
    """``(3,)``: x (m), y (m), theta (rad)."""
    epoch: int
    """Which of its maps (a restarted robot may start a new one)."""
    bodies_m: NDArray[np.float64] = field(default_factory=lambda: np.empty((0, 2)))
    """``(N, 2)``, what it saw from there that may be a robot, in its base frame; empty where it reports nothing."""


@dataclass(frozen=True, eq=False)
class TeammateClaim:
    """What a teammate's sightings of a third robot, or of this one, say of a transform between two maps."""

    peer: str
    epoch: int
    """Which of the peer's maps it is about."""
    robot: str
    T_peer_robot: NDArray[np.float64]
    """``(3,)``: maps points of the robot's map into that of the peer."""
    llr: float
    """Log-likelihood ratio, nats: above 0 for the transform, below 0 against it."""
    of_robot: int | None = None
    """Which of the robot's maps: its epoch modulo ``EPOCHS``; None where the peer's program does not say."""

    def is_of(self, peer_epoch: int, robot_epoch: int) -> bool:
        """Return whether it is about the maps of these epochs: a robot that begins a new map begins a new frame."""
        return self.epoch == peer_epoch and self.of_robot in (None, robot_epoch % EPOCHS)


@dataclass(frozen=True, eq=False)
class TeammateHint:
    """Where a teammate found another robot's map, this one's or a saved one in its own: a place to look at."""

    peer: str
    epoch: int
    """Which of the peer's maps it is about."""
    robot: str
    T_peer_robot: NDArray[np.float64]
    """``(3,)``: maps points of the robot's map into that of the peer."""


@dataclass(frozen=True)
class DuplicateId:
    """Another live process uses my robot id."""

    robot_id: str
    own_boot_id: int
    other_boot_id: int
    am_newcomer: bool
    """Whether I started later: then this process must stop."""


@dataclass(frozen=True)
class Dropped:
    """Bad input was thrown away; emitted at the first of a kind and at each doubling after that."""

    kind: str
    count: int
    sender: str | None


Effect = (
    Send
    | PeerSeen
    | PeerGone
    | LinkChanged
    | ExchangeStarted
    | ExchangeDone
    | ExchangeFailed
    | MapUpdated
    | TeammatePose
    | TeammateClaim
    | TeammateHint
    | DuplicateId
    | Dropped
)
