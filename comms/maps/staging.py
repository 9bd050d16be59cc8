"""A snapshot that arrives in parts: what is here, what is missing, and how the whole is made."""

from __future__ import annotations

from dataclasses import dataclass, field

from mrslam.comms.maps.snapshots import Proof, Snapshot
from mrslam.comms.wire.keyframe_codec import BLOCK, KeyframeBlock
from mrslam.comms.wire.messages import Manifest
from mrslam.spatial import Tile, TiledMap
from mrslam.spatial.tiles import TileIndex


@dataclass
class Staging:
    """Parts of a snapshot that has not arrived whole; kept when a link breaks."""

    epoch: int
    manifest: Manifest | None = None
    """The last one that parts were gathered for."""
    tiles: dict[TileIndex, Tile] = field(default_factory=dict)
    blocks: dict[int, KeyframeBlock] = field(default_factory=dict)
    """By number of the block in the map."""

    @property
    def target(self) -> int:
        """Revision that the manifest leads to; 0 without one."""
        return 0 if self.manifest is None else self.manifest.target

    def keep_for(self, manifest: Manifest) -> None:
        """Gather for this manifest from now on, and drop parts that it does not name."""
        if manifest is self.manifest:
            return
        self.manifest = manifest
        places, blocks = set(changed_tiles(manifest)), set(manifest.blocks)
        self.tiles = {index: tile for index, tile in self.tiles.items() if index in places}
        self.blocks = {i: block for i, block in self.blocks.items() if i in blocks}

    def missing(self, manifest: Manifest) -> tuple[list[int], list[int]]:
        """Return positions in the manifest's tile list and its block list of what has not arrived yet."""
        tiles = [
            k
            for k, (row, col, age) in enumerate(zip(manifest.rows, manifest.cols, manifest.ages, strict=True))
            if (tile := self.tiles.get((row, col))) is None or tile.revision != manifest.target - age
        ]
        blocks = [
            k
            for k, (i, age) in enumerate(zip(manifest.blocks, manifest.block_ages, strict=True))
            if (block := self.blocks.get(i)) is None or block.revision != manifest.target - age
        ]
        return tiles, blocks

    def laid_on(self, base: Snapshot, manifest: Manifest, proof: Proof | None) -> Snapshot:
        """Return ``base`` with all that the manifest names; nothing of that may be missing."""
        tiles = dict(base.map.tiles)
        tiles.update({index: self.tiles[index] for index in changed_tiles(manifest)})
        blocks = dict(enumerate(base.blocks))
        blocks.update({i: self.blocks[i] for i in manifest.blocks})
        count = -(-manifest.keyframes // BLOCK)
        return Snapshot(
            manifest.epoch,
            TiledMap(manifest.resolution_m, tiles, manifest.target),
            tuple(blocks[i] for i in range(count) if i in blocks),
            proof,
        )


def changed_tiles(manifest: Manifest) -> tuple[TileIndex, ...]:
    """Return the places of the tiles that a manifest names."""
    return tuple(zip(manifest.rows, manifest.cols, strict=True))
