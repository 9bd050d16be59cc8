"""The store: the newest whole snapshot of every robot's map, and older ones to send differences from.

Readers only ever see whole snapshots. Versions never decrease, but where a robot disowns one. Maps are kept as their
own robots made them, never merged, so no evidence is counted twice by whichever way it came.
"""

from __future__ import annotations

from collections import Counter, OrderedDict
from dataclasses import replace
from typing import Any

from mrslam.comms.config import CommsConfig
from mrslam.comms.maps.seal import MapSeal
from mrslam.comms.maps.snapshots import Snapshot, published, relabelled
from mrslam.comms.wire.fields import is_saved
from mrslam.comms.wire.messages import Version
from mrslam.spatial import LocalMap

NOTHING: Version = (0, 0)
"""The version of a map that is not held."""
LAST_EPOCH = 2**61 + 2**32
"""Claims of my own map's epoch above this are lies, for boot ids end at 2^61 and each map begun adds one: a robot must
always be able to go above what is claimed, and to begin maps after that, with numbers that fit into a message."""


class MapStore:
    """All maps one robot knows: the own, teammates' by robot id, and saved ones by their names."""

    def __init__(self, own_id: str, epoch: int, config: CommsConfig) -> None:
        """Start with nothing; ``epoch`` labels the own map, and is higher at every start of the robot."""
        self.own_id = own_id
        self.own_epoch = self._first_epoch = max(epoch, 1)
        self.maps: dict[str, LocalMap] = {}
        self.sizes: Counter[bool] = Counter()
        """How many maps it knows, by whether they are saved ones."""
        self.given: set[str] = set()
        """Saved maps that this robot was given itself: it takes no other map of their names."""
        self.disowned: dict[str, Version] = {}
        """By robot: the version that it disowned itself; from there on its map is taken from the robot alone."""
        self._config = config
        self.seal: MapSeal | None = None
        self._newest: dict[str, Snapshot] = {}
        self._history: dict[str, OrderedDict[Version, Snapshot]] = {}
        self.states: dict[str, tuple[Snapshot, dict[str, Any]]] = {}
        """By robot: a snapshot and its state on disk (a cache): few maps have changed since the last checkpoint."""

    def use_seal(self, seal: MapSeal) -> None:
        """Sign the own map from now on, and take only signed ones."""
        self.seal = seal
        for name in (self.own_id, *sorted(self.given)):
            if name in self._newest:
                self.put(name, self._newest[name])

    def version(self, robot_id: str) -> Version:
        """Return (epoch, revision) of the newest map of a robot; (0, 0) where nothing is known."""
        newest = self._newest.get(robot_id)
        return NOTHING if newest is None else newest.version

    def digest(self) -> dict[str, Version]:
        """Return the version of every robot's map held, by robot id."""
        return {robot: self._newest[robot].version for robot in sorted(self._newest) if not is_saved(robot)}

    def saved_digest(self) -> dict[str, Version]:
        """Return the version of every saved map held, by name."""
        return {name: self._newest[name].version for name in sorted(self._newest) if is_saved(name)}

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
        """Take the own newest map; return whether its revision is newer.

        A lower revision, or another resolution, begins another map (a new epoch).
        """
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
        self.put(self.own_id, snapshot)
        return True

    def give(self, map_id: str, local_map: LocalMap, epoch: int) -> LocalMap:
        """Take a saved map to offer it to teammates; return it as they will get it.

        ``epoch`` : a number of its content, so that robots that were given the same map hold the same version.
        """
        snapshot = published(local_map, None, epoch)
        if snapshot is None:
            raise ValueError(f"the saved map {map_id} has no revision")
        self.given.add(map_id)
        self.put(map_id, snapshot)
        return self.maps[map_id]

    def begin_map(self) -> None:
        """Start a new epoch: what is published next is another map, whatever its revision."""
        if self.version(self.own_id)[0] == self.own_epoch:
            self.own_epoch = self._unused_epoch()
            self._history.pop(self.own_id, None)

    def _unused_epoch(self) -> int:
        """Return an epoch that no earlier run used, not even after the checkpoint from which this one was restored."""
        return max(self.own_epoch + 1, self._first_epoch)

    def outrank(self, version: Version) -> bool:
        """Relabel the own map above a version of an earlier life that a teammate holds; return whether needed."""
        if not self.is_outranked_by(version):
            return False
        self.new_epoch(version[0] + 1)
        return True

    def is_outranked_by(self, version: Version) -> bool:
        """Return whether a version of the own map is above the own one, and one that a robot can go above."""
        return version > max(self.version(self.own_id), (self.own_epoch, 0)) and version[0] <= LAST_EPOCH

    def disown(self, robot_id: str) -> None:
        """Give up a map that its own robot disowns; versions as high are taken only from that robot now.

        Readers of ``maps`` see it until the robot's own map replaces it.
        """
        snapshot = self._newest.pop(robot_id, None)
        self._history.pop(robot_id, None)
        if snapshot is not None:
            self.disowned[robot_id] = snapshot.version

    def new_epoch(self, epoch: int | None = None) -> None:
        """Give the own map a new epoch, by default an unused one: teammates take it for another map."""
        own = self._newest.get(self.own_id)
        is_current = own is not None and own.epoch == self.own_epoch
        self.own_epoch = self._unused_epoch() if epoch is None else epoch
        self._history.pop(self.own_id, None)
        if own is not None and is_current:
            self.put(self.own_id, relabelled(own, self.own_epoch))

    def put(self, robot_id: str, snapshot: Snapshot) -> None:
        """Make a snapshot the newest of its robot, for all to read.

        Where there are keys the own one is signed, and saved ones that this robot was given.
        """
        for tile in snapshot.map.tiles.values():
            if tile.cells.flags.writeable:
                tile.cells.flags.writeable = False
        if self.seal is not None and (robot_id == self.own_id or robot_id in self.given):
            snapshot = replace(snapshot, proof=self.seal.sign(robot_id, snapshot))
        local_map = snapshot.local_map  # first: it raises where the parts do not fit together
        self.sizes[is_saved(robot_id)] += robot_id not in self.maps
        self.maps[robot_id] = local_map
        self._newest[robot_id] = snapshot
