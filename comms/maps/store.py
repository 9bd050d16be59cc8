"""What a robot knows: the newest whole map of every robot, older ones to send differences from, and half-arrived ones.

Readers only ever see whole snapshots. Versions never go back. Only maps as their own robots made them are kept, so no
evidence is counted twice however it travelled.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import replace

from mrslam.comms.config import CommsConfig
from mrslam.comms.maps.seal import MapSeal
from mrslam.comms.maps.snapshots import Proof, Snapshot, published, relabelled
from mrslam.comms.maps.staging import Staging, changed_tiles
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.messages import Manifest, SignedManifest, Version
from mrslam.spatial import LocalMap, TiledMap
from mrslam.spatial.tiles import TileIndex

NOTHING: Version = (0, 0)
"""The version of a map one has nothing of."""
LAST_EPOCH = 2**61 + 2**32
"""Claims of my own map's epoch above this are lies, for boot ids end at 2^61 and each map begun adds one: a robot must
always be able to go above what is claimed, and to begin maps after that, with numbers that fit into a message."""


class MapStore:
    """All maps one robot knows; own and others', by robot id."""

    def __init__(self, own_id: str, epoch: int, config: CommsConfig) -> None:
        """Start with nothing; ``epoch`` labels the own map, and is higher at every start of the robot."""
        self.own_id = own_id
        self.own_epoch = self._first_epoch = max(epoch, 1)
        self.maps: dict[str, LocalMap] = {}
        self.staging: dict[str, Staging] = {}
        self._config = config
        self._seal: MapSeal | None = None
        self._newest: dict[str, Snapshot] = {}
        self._history: dict[str, OrderedDict[Version, Snapshot]] = {}

    def use_seal(self, seal: MapSeal) -> None:
        """Sign the own map from now on, and take only signed ones."""
        self._seal = seal
        own = self._newest.get(self.own_id)
        if own is not None:
            self._set(self.own_id, own)

    def version(self, robot_id: str) -> Version:
        """Return (epoch, revision) of the newest map of a robot; (0, 0) where nothing is known."""
        newest = self._newest.get(robot_id)
        return NOTHING if newest is None else newest.version

    def digest(self) -> dict[str, Version]:
        """Return the version of every map held, by robot id."""
        return {robot: self._newest[robot].version for robot in sorted(self._newest)}

    def newest(self, robot_id: str) -> Snapshot | None:
        """Return the newest snapshot of a robot."""
        return self._newest.get(robot_id)

    def at(self, robot_id: str, epoch: int, revision: int) -> Snapshot | None:
        """Return the snapshot of exactly this version if it is still kept."""
        newest = self._newest.get(robot_id)
        if newest is not None and newest.version == (epoch, revision):
            return newest
        return self._history.get(robot_id, OrderedDict()).get((epoch, revision))

    def remember(self, robot_id: str, snapshot: Snapshot) -> None:
        """Keep a snapshot that a peer will hold, so that later only differences from it need to be sent."""
        kept = self._history.setdefault(robot_id, OrderedDict())
        kept[snapshot.version] = snapshot
        kept.move_to_end(snapshot.version)
        while len(kept) > self._config.history:
            kept.popitem(last=False)

    def publish(self, local_map: LocalMap) -> bool:
        """Take the own newest map; return whether it is news."""
        before = self._newest.get(self.own_id)
        if before is not None and (
            local_map.map.revision < before.map.revision or local_map.map.resolution_m != before.map.resolution_m
        ):
            self.begin_map()
        if before is not None and before.epoch != self.own_epoch:
            before = None
        snapshot = published(local_map, before, self.own_epoch)
        if snapshot is None:
            return False
        self._set(self.own_id, snapshot)
        return True

    def take_up(self, robot_id: str, snapshot: Snapshot) -> None:
        """Put a snapshot of an earlier life in place."""
        self._set(robot_id, snapshot)

    def begin_map(self) -> None:
        """What is published next is another map, not the last one gone on, whatever its revision."""
        if self.version(self.own_id)[0] == self.own_epoch:
            self.own_epoch = self._unused_epoch()
            self._history.pop(self.own_id, None)

    def _unused_epoch(self) -> int:
        """Return a label for a map that no earlier life used, not even after the saving this one began with."""
        return max(self.own_epoch + 1, self._first_epoch)

    def outrank(self, version: Version) -> bool:
        """Relabel the own map above a version that a teammate holds of my earlier life; return whether needed."""
        if version <= max(self.version(self.own_id), (self.own_epoch, 0)) or version[0] > LAST_EPOCH:
            return False
        self.new_epoch(version[0] + 1)
        return True

    def new_epoch(self, epoch: int | None = None) -> None:
        """Give the own map a new label, by default an unused one: whoever holds it takes it for another map."""
        own = self._newest.get(self.own_id)
        goes_on = own is not None and own.epoch == self.own_epoch
        self.own_epoch = self._unused_epoch() if epoch is None else epoch
        self._history.pop(self.own_id, None)
        if own is not None and goes_on:
            self._set(self.own_id, relabelled(own, self.own_epoch))

    def may_take(self, robot_id: str) -> bool:
        """Return whether there is room for this robot's map."""
        return robot_id in self._newest or len(self._newest) < self._config.max_robots

    def try_commit(self, manifest: Manifest) -> tuple[TileIndex, ...] | None:
        """Put a staged snapshot in place if all of the manifest is there; return the changed tiles, else None.

        Raises :class:`WireError` where it is not what the manifest says, or not what the map's own robot signed.
        """
        robot, staging, base = manifest.robot, self._parts_of(manifest), self.base_of(manifest)
        if base is None or any(staging.missing(manifest)) or (manifest.epoch, manifest.target) <= self.version(robot):
            return None
        whole = staging.laid_on(base, manifest, self._proof_of(manifest))
        self.staging.pop(robot, None)
        if whole.keyframes != manifest.keyframes:
            raise WireError("bad manifest", "keyframes do not come to what it says")
        if self._is_forged(robot, whole):
            raise WireError("forged", f"a map of {robot!r} that is not what it signed")
        self._set(robot, whole)
        self.remember(robot, whole)
        return changed_tiles(manifest)

    def _is_forged(self, robot: str, snapshot: Snapshot) -> bool:
        if self._seal is None:
            return False
        return snapshot.proof is None or self._seal.root_of(robot, snapshot) != snapshot.proof.root

    def check_proof(self, manifest: Manifest) -> None:
        """Raise :class:`WireError` where the team has keys and the map's own robot did not sign the target."""
        if self._seal is None:
            return
        proof = self._proof_of(manifest)
        if proof is None:
            raise WireError("forged", f"a map of {manifest.robot!r} without a signature")
        self._seal.check(manifest.robot, (manifest.epoch, manifest.target), proof)

    def _proof_of(self, manifest: Manifest) -> Proof | None:
        """Return the proof that a manifest bears; the certificate is left out where the asker has it already."""
        if not isinstance(manifest, SignedManifest):
            return None
        held = self._newest.get(manifest.robot)
        certificate = manifest.certificate
        if not certificate and held is not None and held.proof is not None:
            certificate = held.proof.certificate
        return Proof(manifest.root, manifest.signature, certificate)

    def missing(self, manifest: Manifest) -> tuple[list[int], list[int]]:
        """Return positions in the manifest's tile list and its block list of what has not arrived yet."""
        return self._parts_of(manifest).missing(manifest)

    def base_of(self, manifest: Manifest) -> Snapshot | None:
        """Return the map a manifest's differences apply to, empty for base 0; None where I hold another one now."""
        if manifest.base == 0:
            return Snapshot(manifest.epoch, TiledMap(manifest.resolution_m), ())
        held = self._newest.get(manifest.robot)
        return held if held is not None and held.version == (manifest.epoch, manifest.base) else None

    def stage(self, manifest: Manifest) -> Staging:
        """Return where the parts of this manifest's target are gathered, keeping parts that still hold.

        There are not more of them than robots may be known: the oldest of a robot of which there is no map goes first.
        """
        staging = self._parts_of(manifest)
        self.staging.pop(manifest.robot, None)  # the newest comes last
        self.staging[manifest.robot] = staging
        staging.keep_for(manifest)
        strangers = [robot for robot in self.staging if robot not in self._newest]
        for robot in strangers[: max(len(self._newest) + len(strangers) - self._config.max_robots, 0)]:
            del self.staging[robot]
        return staging

    def _parts_of(self, manifest: Manifest) -> Staging:
        """Return what has arrived of this manifest's target, or of an older one of the same epoch."""
        staging = self.staging.get(manifest.robot)
        return staging if staging is not None and staging.epoch == manifest.epoch else Staging(manifest.epoch)

    def staged(self) -> dict[str, Version]:
        """Return which snapshots have arrived in part."""
        return {robot: (part.epoch, part.target) for robot, part in sorted(self.staging.items())}

    def _set(self, robot_id: str, snapshot: Snapshot) -> None:
        for tile in snapshot.map.tiles.values():
            if tile.cells.flags.writeable:
                tile.cells.flags.writeable = False
        if self._seal is not None and robot_id == self.own_id:
            snapshot = replace(snapshot, proof=self._seal.sign(snapshot))
        self._newest[robot_id] = snapshot
        self.maps[robot_id] = snapshot.local_map
