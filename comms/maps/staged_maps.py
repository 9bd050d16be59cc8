"""Staging of others' maps: parts are gathered beside the store, and put in place whole or not at all."""

from __future__ import annotations

from mrslam.comms.config import CommsConfig
from mrslam.comms.maps.snapshots import Proof, Snapshot
from mrslam.comms.maps.staging import Staging, changed_tiles
from mrslam.comms.maps.store import MapStore
from mrslam.comms.wire.fields import is_saved
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.keyframe_codec import BLOCK
from mrslam.comms.wire.messages import Manifest, SignedManifest, Version
from mrslam.spatial import InputError, TiledMap
from mrslam.spatial.tiles import TileIndex


class StagedMaps:
    """Snapshots that have arrived in part, by robot."""

    def __init__(self, store: MapStore, config: CommsConfig) -> None:
        """Start with none; whole ones go into ``store``."""
        self.staging: dict[str, Staging] = {}
        self._store, self._max_robots = store, config.max_robots

    def has_room(self, robot_id: str) -> bool:
        """Return whether there is room for this map; saved maps take none of that of robots' maps."""
        return robot_id in self._store.maps or self._store.sizes[is_saved(robot_id)] < self._max_robots

    def staged(self) -> dict[str, Version]:
        """Return (epoch, revision) of robots' snapshots that have arrived in part, by robot."""
        parts = sorted(self.staging.items())
        return {robot: (part.epoch, part.target) for robot, part in parts if not is_saved(robot)}

    def base_of(self, manifest: Manifest) -> Snapshot | None:
        """Return the map a manifest's differences apply to, empty for base 0; None where another one is held now."""
        if manifest.base == 0:
            return Snapshot(manifest.epoch, TiledMap(manifest.resolution_m, {}, 0), ())
        held = self._store.newest(manifest.robot)
        return held if held is not None and held.version == (manifest.epoch, manifest.base) else None

    def missing(self, manifest: Manifest) -> tuple[list[int], list[int]]:
        """Return positions in the manifest's tile list and its block list of what has not arrived yet."""
        return self._parts_of(manifest).missing(manifest)

    def stage(self, manifest: Manifest) -> Staging:
        """Return the staging for this manifest's target, with the parts staged before that the manifest names.

        At most ``max_robots`` have a map or a staging, and as many saved maps: of those without a map, the longest
        unused staging goes first.
        """
        staging = self._parts_of(manifest)
        self.staging.pop(manifest.robot, None)  # the newest comes last
        self.staging[manifest.robot] = staging
        staging.keep_for(manifest)
        kind = is_saved(manifest.robot)
        strangers = [one for one in self.staging if one not in self._store.maps and is_saved(one) == kind]
        for robot in strangers[: max(self._store.sizes[kind] + len(strangers) - self._max_robots, 0)]:
            del self.staging[robot]
        return staging

    def _parts_of(self, manifest: Manifest) -> Staging:
        """Return what has arrived of this manifest's target, or of an older one of the same epoch."""
        staging = self.staging.get(manifest.robot)
        return staging if staging is not None and staging.epoch == manifest.epoch else Staging(manifest.epoch)

    def try_commit(self, manifest: Manifest) -> tuple[TileIndex, ...] | None:
        """Put a staged snapshot in place if all of the manifest is there; return the changed tiles, else None.

        Raises :class:`WireError` where it is not what the manifest says, or not what the map's own robot signed.
        """
        robot, staging, base = manifest.robot, self._parts_of(manifest), self.base_of(manifest)
        is_news = (manifest.epoch, manifest.target) > self._store.version(robot)
        if base is None or not is_news or any(staging.missing(manifest)):
            return None
        self.check_proof(manifest)  # once more: its signer may have been revoked since
        whole = staging.laid_on(base, manifest, self._proof_of(manifest))
        self.staging.pop(robot, None)
        if whole.keyframes != manifest.keyframes:
            raise WireError("bad manifest", "keyframes do not come to what it says")
        if any(block.stamps_ns.size != BLOCK for block in whole.blocks[:-1]):
            raise WireError("bad manifest", "a block that is not the last is not full")
        if self._is_forged(robot, whole):
            raise WireError("forged", f"a map of {robot!r} that is not what it signed")
        try:
            self._store.put(robot, whole)
        except InputError as error:
            raise WireError("bad manifest", f"its parts do not fit together: {error}") from error
        self._store.remember(robot, whole)
        return changed_tiles(manifest)

    # -- signatures ------------------------------------------------------------------------------------------------

    def check_proof(self, manifest: Manifest) -> None:
        """Raise :class:`WireError` where the team has keys and the map's own robot did not sign the target."""
        if self._store.seal is None:
            return
        proof = self._proof_of(manifest)
        if proof is None:
            raise WireError("forged", f"a map of {manifest.robot!r} without a signature")
        self._store.seal.check(manifest.robot, (manifest.epoch, manifest.target), proof)

    def _proof_of(self, manifest: Manifest) -> Proof | None:
        """Return the proof that a manifest bears; the certificate is left out where the asker has it already."""
        if not isinstance(manifest, SignedManifest):
            return None
        held = self._store.newest(manifest.robot)
        certificate = manifest.certificate
        if not certificate and held is not None and held.proof is not None:
            certificate = held.proof.certificate
        return Proof(manifest.root, manifest.signature, certificate)

    def _is_forged(self, robot: str, snapshot: Snapshot) -> bool:
        if self._store.seal is None:
            return False
        return snapshot.proof is None or self._store.seal.root_of(robot, snapshot) != snapshot.proof.root
