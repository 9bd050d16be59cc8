"""One exchange with one peer: what was asked, what is still to come, what it cost."""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass, field

from mrslam.comms.config import CommsConfig
from mrslam.comms.exchange.in_flight import InFlight
from mrslam.comms.maps.content import open_chunk
from mrslam.comms.maps.snapshots import Snapshot
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.bitmask import to_mask
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import BLOCK
from mrslam.comms.wire.messages import Chunk, Get, Manifest, Version
from mrslam.spatial.tiles import MOST_CELLS, TileIndex, box_cells

MAX_OFFERED = 1024
"""Manifests one exchange remembers."""

Offer = tuple[str, int, int, int]
"""A manifest's robot, epoch, base and target."""


def offer_of(one: Manifest | Get) -> Offer:
    """Return which manifest this is, or is about."""
    return one.robot, one.epoch, one.base, one.target


@dataclass
class Pull:
    """The taking side for one robot's map."""

    robot: str
    manifest: Manifest | None = None
    asked: set[int] = field(default_factory=set)
    """Items of the manifest asked for and not here yet."""


@dataclass
class Exchange:
    """Both sides of one meeting, as one robot sees it."""

    peer: str
    xid: int
    opened_by_me: bool
    started_ns: int
    progress_ns: int
    accepted: bool = False
    theirs: dict[str, Version] = field(default_factory=dict)
    """What the peer held when the exchange began."""
    pulls: dict[str, Pull] = field(default_factory=dict)
    offered: OrderedDict[Offer, Manifest] = field(default_factory=OrderedDict)
    """Manifests I gave."""
    in_flight: dict[Offer, InFlight] = field(default_factory=dict)
    """What of them was sent."""
    useful_ns: int = 0
    """When it last came nearer to its end; messages that go round in circles do not count."""
    asked_ns: int = 0
    retries: int = 0
    is_done: bool = False
    """I have told the peer that I hold what I wanted."""
    peer_done: bool = False
    broken: str = ""
    """Why it cannot go on."""
    budget_spent: bool = False
    bytes_sent: int = 0
    bytes_received: int = 0
    served: int = 0
    """Bytes of chunks given."""
    tiles: int = 0
    whole: dict[str, Snapshot] = field(default_factory=dict)
    """The maps this meeting was about on my side: what sending them whole would have cost is told at its end."""

    def offer(self, manifest: Manifest) -> None:
        """Remember a manifest that was given, for the requests that refer to it."""
        self.offered[offer_of(manifest)] = manifest
        while len(self.offered) > MAX_OFFERED:
            self.in_flight.pop(self.offered.popitem(last=False)[0], None)

    def costs(self, now_ns: int) -> tuple[str, int, int, int, int, int, float]:
        """Return what it came to, as its end is told: peer, bytes sent, received, whole as LZ4 and raw, tiles, s."""
        whole = [snapshot.full_bytes for snapshot in self.whole.values()]
        lz4, raw = sum(size for size, _ in whole), sum(size for _, size in whole)
        return self.peer, self.bytes_sent, self.bytes_received, lz4, raw, self.tiles, (now_ns - self.started_ns) / 1e9

    def retry_ns(self, config: CommsConfig) -> int:
        """Return after how much silence to ask again."""
        return round(config.retry_s * 1e9) << min(self.retries, 2)


def check_manifest(manifest: Manifest, config: CommsConfig) -> None:
    """Raise :class:`WireError` where a manifest contradicts itself or is beyond the bounds."""
    span = manifest.target - manifest.base
    blocks = -(-manifest.keyframes // BLOCK)
    ages = manifest.ages + manifest.block_ages
    if span <= 0 or manifest.epoch == 0 or (ages and max(ages) >= span):
        raise WireError("bad manifest", "revisions")
    if not len(manifest.rows) == len(manifest.cols) == len(manifest.ages):
        raise WireError("bad manifest", "tile lists differ in length")
    if len(manifest.rows) > config.max_tiles or len(set(zip(manifest.rows, manifest.cols, strict=True))) != len(
        manifest.rows
    ):
        raise WireError("bad manifest", "tiles")
    if (
        manifest.keyframes > config.max_keyframes
        or len(manifest.block_ages) != len(manifest.blocks)
        or len(set(manifest.blocks)) != len(manifest.blocks)
        or (manifest.blocks and max(manifest.blocks) >= blocks)
    ):
        raise WireError("bad manifest", "keyframes")


def check_extent(manifest: Manifest, base: Snapshot, config: CommsConfig) -> None:
    """Raise :class:`WireError` where the map would span more cells than any memory holds, or hold too many tiles."""
    tiles = {*base.map.tiles, *zip(manifest.rows, manifest.cols, strict=True)}
    if box_cells(tiles) > MOST_CELLS or len(tiles) > config.max_tiles:
        raise WireError("bad manifest", "the map is too large")


def next_get(pull: Pull, store: MapStore, sender: str, xid: int, config: CommsConfig) -> Get | None:
    """Return the request for the most valuable items not here yet, as many as may be on the way; None for nothing."""
    manifest = pull.manifest
    if manifest is None:
        return None
    tiles, blocks = store.missing(manifest)
    wanted = tiles + [len(manifest.rows) + k for k in blocks]
    pull.asked = set(wanted[: config.window_tiles])
    if not pull.asked:
        return None
    mask = to_mask(sorted(pull.asked))
    return Get(sender, xid, manifest.robot, manifest.epoch, manifest.base, manifest.target, mask)


def take_chunk(pull: Pull, chunk: Chunk, store: MapStore) -> list[TileIndex]:
    """Stage a chunk's content and return its tiles; raise :class:`WireError` where it does not hold what it says."""
    manifest = pull.manifest
    if manifest is None or (chunk.epoch, chunk.base, chunk.target) != (
        manifest.epoch,
        manifest.base,
        manifest.target,
    ):
        return []  # of a manifest that was replaced
    base = store.base_of(manifest)
    if base is None:
        return []
    blocks, tiles = open_chunk(chunk, manifest, base)
    staging = store.stage(manifest)
    staging.blocks.update(blocks)
    staging.tiles.update(tiles)
    where = zip(manifest.rows, manifest.cols, strict=True)
    here = {k for k, index in enumerate(where) if index in tiles}
    here |= {len(manifest.rows) + k for k, i in enumerate(manifest.blocks) if i in blocks}
    pull.asked -= here
    return list(tiles)
