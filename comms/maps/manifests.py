"""Manifests: what one robot lacks of a map that another holds. How they are made, and what makes one unacceptable."""

from __future__ import annotations

from mrslam.comms.config import CommsConfig
from mrslam.comms.maps.snapshots import Snapshot, value_of
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import BLOCK
from mrslam.comms.wire.messages import Manifest, SignedManifest, Version
from mrslam.spatial.tiles import MOST_CELLS, box_cells


def make_manifest(
    store: MapStore, sender: str, xid: int, robot: str, held: Version, staged: Version | None
) -> Manifest | None:
    """Return what one who holds version ``held`` lacks of a robot's map, most valuable tiles first; None for nothing.

    ``staged``: the snapshot the asker has in part and wants to finish first, where it is still kept here.
    """
    target = store.newest(robot)
    if staged is not None and staged > held and (older := store.at(robot, *staged)) is not None:
        target = older
    if target is None or target.version <= held:
        return None
    base_revision = held[1] if held[0] == target.epoch else 0
    base = store.at(robot, target.epoch, base_revision) if base_revision else None
    if _replaces(target, base, base_revision):
        base_revision, base = 0, None
    store.remember(robot, target)
    old = {} if base is None else base.map.tiles
    changed = target.map.changed_since(base_revision)
    order = sorted(changed, key=lambda index: (-value_of(changed[index], old.get(index)), index))
    blocks = [i for i, block in enumerate(target.blocks) if block.revision > base_revision]
    revision = target.map.revision
    manifest = Manifest(
        sender,
        xid,
        robot,
        target.epoch,
        base_revision,
        revision,
        target.map.resolution_m,
        target.keyframes,
        blocks,
        [revision - target.blocks[i].revision for i in blocks],
        [row for row, _ in order],
        [col for _, col in order],
        [revision - changed[index].revision for index in order],
    )
    if target.proof is None:
        return manifest
    certificate = target.proof.certificate
    if base is not None and base.proof is not None and base.proof.certificate == certificate:
        certificate = b""  # the asker has it with what it holds
    fields = {name: getattr(manifest, name) for name in Manifest.__struct_fields__}
    return SignedManifest(**fields, root=target.proof.root, signature=target.proof.signature, certificate=certificate)


def _replaces(target: Snapshot, base: Snapshot | None, base_revision: int) -> bool:
    """Return whether to send the whole target instead of differences, as after its robot was restored from disk.

    Then the asker may hold tiles that the target does not have at all, and differences would leave them in place.
    """
    if base is not None:
        return any(index not in target.map.tiles for index in base.map.tiles)
    return all(tile.revision > base_revision for tile in target.map.tiles.values())


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
    """Raise :class:`WireError` where the map would span above ``MOST_CELLS`` cells or hold above ``max_tiles``."""
    tiles = {*base.map.tiles, *zip(manifest.rows, manifest.cols, strict=True)}
    if box_cells(tiles) > MOST_CELLS or len(tiles) > config.max_tiles:
        raise WireError("bad manifest", "the map is too large")
