"""Receives maps in exchanges: follows manifests, asks for their items, and puts whole snapshots in place."""

from __future__ import annotations

from mrslam.comms.effects import MapUpdated
from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.exchange.exchange import Exchange
from mrslam.comms.exchange.pull import Pull, next_get, take_chunk
from mrslam.comms.maps.manifests import check_extent, check_manifest
from mrslam.comms.wire.fields import is_saved
from mrslam.comms.wire.frames import WireError
from mrslam.comms.wire.messages import Ask, Chunk, Manifest, Version

BEYOND: Version = (2**62 + 1, 0)
"""Above every version."""

MOST_IDLE = 4096
"""Pairs of a peer and a robot remembered as idle; bounds memory alone."""


class MapReceiver:
    """Receives maps, each from one peer at a time."""

    def __init__(self, context: ExchangeContext) -> None:
        """Receive into this robot's store."""
        self._context = context
        self._source: dict[str, Exchange] = {}  # robot -> the exchange in which its map is being taken
        self._idle: set[tuple[str, str]] = set()  # (peer, robot): asked for items of the map, and has sent none since

    def wants(self, peer: str, robot: str, version: Version) -> bool:
        """Return whether this version of a robot's map is worth taking from this peer now."""
        store = self._context.store
        if robot == self._context.own_id or self._context.mode == "mapper" or version <= store.version(robot):
            return False
        if is_saved(robot) and (robot in store.given or not self._context.shares_saved_maps):
            return False
        if peer != robot and version >= store.disowned.get(robot, BEYOND):
            return False
        return self._context.staged_maps.has_room(robot) and self._may_bring(peer, robot)

    def _may_bring(self, peer: str, robot: str) -> bool:
        """Return whether a robot's map may be taken from a peer: one brings it, until it turns out to bring nothing.

        A manifest is easily made up, so a peer that has let one pass without an item keeps nobody else from it; and one
        that brings an item now and then keeps nobody from the robot itself.
        """
        source = self._source.get(robot)
        return source is None or peer in (source.peer, robot) or (source.peer, robot) in self._idle

    def wants_more(self, exchange: Exchange) -> bool:
        """Return whether the peer has a version of some map that is still wanted from it."""
        return bool(exchange.pulls) or any(self.wants(exchange.peer, *item) for item in exchange.theirs.items())

    def on_manifest(self, exchange: Exchange, message: Manifest) -> None:
        """Take a manifest of what is missing of one map; raises ``WireError`` where it is not valid or is forged."""
        staged_maps = self._context.staged_maps
        if self._disowns(exchange, message):
            self._context.store.disown(message.robot)
        if not self.wants(exchange.peer, message.robot, (message.epoch, message.target)):
            return
        try:
            check_manifest(message, self._context.config)
            staged_maps.check_proof(message)
            base = staged_maps.base_of(message)
            if base is not None:
                check_extent(message, base, self._context.config)
        except WireError:
            self._distrust(exchange, message.robot)
            raise
        pull = exchange.pulls.setdefault(message.robot, Pull(message.robot))
        if self._is_at_work(pull, message):
            return  # it came twice; or two questions crossed, and following both answers would never end
        before = self._source.get(message.robot)
        if before is not None and before is not exchange:
            before.pulls.pop(message.robot, None)
        self._source[message.robot] = exchange
        if base is None:
            pull.manifest = None
            self._ask(exchange, message.robot)
            return
        pull.manifest = message
        self._continue(exchange, pull)

    def _disowns(self, exchange: Exchange, message: Manifest) -> bool:
        """Return whether a robot offers its own map at a version below the one it knows is held here, without keys.

        A robot goes above what its earlier lives labelled (``own_map_claims``), so what is held is not its own: made up
        by some other robot, or lifted beyond all numbers by a false claim.
        """
        held = self._context.store.version(message.robot)
        is_own_word = message.robot == exchange.peer and self._context.store.seal is None
        return is_own_word and message.base == 0 and held == exchange.shown and message.epoch < held[0]

    def _is_at_work(self, pull: Pull, other: Manifest) -> bool:
        """Return whether items are on their way, of a manifest that is as new as the other one and still applies."""
        current = pull.manifest
        if current is None or not pull.asked or self._context.staged_maps.base_of(current) is None:
            return False
        return (current.epoch, current.target) >= (other.epoch, other.target)

    def on_chunk(self, exchange: Exchange, message: Chunk, now_ns: int) -> None:
        """Take items that were asked for; raises ``WireError`` where the content is not what the chunk says."""
        pull = exchange.pulls.get(message.robot)
        if pull is None:
            return
        waiting = len(pull.asked)
        exchange.tiles += len(take_chunk(pull, message, self._context.staged_maps))
        if len(pull.asked) < waiting:
            exchange.useful_ns = now_ns
            self._idle.discard((exchange.peer, message.robot))
            pull.has_brought = True
        if not pull.asked:
            self._continue(exchange, pull)

    def ask_again(self, exchange: Exchange) -> None:
        """Repeat, after silence, every question that is open."""
        for robot, version in exchange.theirs.items():
            if robot not in exchange.pulls and self.wants(exchange.peer, robot, version):
                self._ask(exchange, robot)
        for pull in list(exchange.pulls.values()):
            self._note_if_idle(exchange.peer, pull)
            if pull.manifest is None or self._context.staged_maps.base_of(pull.manifest) is None:
                pull.manifest = None
                self._ask(exchange, pull.robot)
            else:
                self._continue(exchange, pull)

    def release(self, exchange: Exchange) -> None:
        """Take nothing more in this exchange; other peers may be asked for the same maps."""
        for robot in list(exchange.pulls):
            self._drop(exchange, robot)

    def _continue(self, exchange: Exchange, pull: Pull) -> None:
        """Put the snapshot in place if it is whole, else ask for more of it."""
        manifest, staged_maps = pull.manifest, self._context.staged_maps
        if manifest is None:
            return
        try:
            changed = staged_maps.try_commit(manifest)
        except WireError:
            self._distrust(exchange, pull.robot)
            raise
        if changed is not None:
            store = self._context.store
            version, whole = store.version(pull.robot), store.maps[pull.robot]
            self._end_disowning(exchange.peer, manifest)
            self._context.out.emit(MapUpdated(pull.robot, *version, changed, exchange.peer, whole))
            self._drop(exchange, pull.robot)
            return
        get = next_get(pull, staged_maps, self._context.own_id, exchange.xid, self._context.config)
        if get is not None:
            exchange.bytes_sent += self._context.out.post(get, exchange.peer, "control")
            return
        staged_maps.staging.pop(
            pull.robot, None
        )  # all items are here and do not make the target: start this map over in another exchange
        self._drop(exchange, pull.robot)
        exchange.broken = "a snapshot did not fit together"

    def _end_disowning(self, peer: str, manifest: Manifest) -> None:
        """Take a robot's map from all peers again, once it has itself reached the version that it had disowned."""
        disowned = self._context.store.disowned
        if peer == manifest.robot and (manifest.epoch, manifest.target) >= disowned.get(peer, BEYOND):
            del disowned[peer]

    def _distrust(self, exchange: Exchange, robot: str) -> None:
        """The peer sent something false for this robot's map: take no more of it in this exchange."""
        exchange.theirs.pop(robot, None)
        self._drop(exchange, robot)

    def _drop(self, exchange: Exchange, robot: str) -> None:
        pull = exchange.pulls.pop(robot, None)
        if pull is not None:
            self._note_if_idle(exchange.peer, pull)
        if self._source.get(robot) is exchange:
            del self._source[robot]

    def _note_if_idle(self, peer: str, pull: Pull) -> None:
        """Remember a peer that was asked for items of a map and has sent none."""
        if pull.asked and not pull.has_brought:
            if len(self._idle) >= MOST_IDLE:
                self._idle.clear()
            self._idle.add((peer, pull.robot))

    def _ask(self, exchange: Exchange, robot: str) -> None:
        epoch, revision = self._context.store.version(robot)
        question = Ask(self._context.own_id, exchange.xid, robot, epoch, revision)
        exchange.bytes_sent += self._context.out.post(question, exchange.peer, "control")
