"""All exchanges of one robot: opens them, answers, asks again after silence, and ends them. No I/O, no clock."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Callable

from comms.config import CommsConfig
from comms.effects import Effect, ExchangeDone, ExchangeFailed, ExchangeStarted, Lane, MapUpdated
from comms.exchange import Exchange, Pull, check_manifest, next_get, take_chunk
from comms.messages import (
    GIVE_NO_MORE,
    HOLD_ALL,
    LONG_DONE,
    Accept,
    Ask,
    Chunk,
    Done,
    Get,
    Manifest,
    Message,
    Open,
    Refuse,
    Version,
)
from comms.provider import chunks_for, manifest_for
from comms.rendezvous import Rendezvous
from comms.store import NOTHING, MapStore

Post = Callable[[Message, str, Lane], int]
"""Sends a message to a peer and returns its size, bytes."""
PATIENCE = 4
"""An exchange without progress, though messages come, has failed after so many times ``stall_timeout_s``."""
REMEMBERED = 256
"""Exchanges that are over, kept to answer late questions about them."""


class Exchanges:
    """The exchanges going on, at most one with each peer."""

    def __init__(
        self,
        own_id: str,
        boot: int,
        mode: str,
        config: CommsConfig,
        store: MapStore,
        rendezvous: Rendezvous,
        post: Post,
        emit: Callable[[Effect], None],
        takes_maps: Callable[[str], bool],
    ) -> None:
        """Start with none; ``post`` sends, ``emit`` tells the shell, ``takes_maps`` whether a peer wants any."""
        self._takes_maps = takes_maps
        self._own_id, self._boot, self._mode, self._config = own_id, boot, mode, config
        self._store, self._rendezvous, self._post, self._emit = store, rendezvous, post, emit
        self.active: dict[str, Exchange] = {}
        self._over: OrderedDict[tuple[str, int], bool] = OrderedDict()
        self._pulling: dict[str, str] = {}  # robot -> the peer its map is being taken from
        self._count = 0

    # -- beginning -------------------------------------------------------------------------------------------------

    def open(self, peer: str, now_ns: int) -> None:
        """Propose an exchange to a peer."""
        self._count += 1
        xid = (self._boot * 2654435761 + self._count) & 0xFFFFFFFF
        exchange = self._begin(peer, xid, True, now_ns)
        self._send_open(exchange)

    def on_open(self, message: Open, size: int, now_ns: int) -> None:
        """A peer proposes an exchange: accept, or say why not."""
        peer, running = message.sender, self.active.get(message.sender)
        if (peer, message.xid) in self._over:
            self._answer_late(peer, message.xid)
            return
        if running is not None and running.xid != message.xid:
            if running.opened_by_me and not running.accepted:
                if self._own_id < peer:
                    return  # both opened at once: the lesser id's proposal stands
                self._drop(running)
            else:
                self._fail(running, "the peer began anew", now_ns)
            running = None
        if running is None:
            reason = self._rendezvous.may_answer(peer)
            if reason is not None:
                self._post(Refuse(self._own_id, message.xid, reason), peer, "control")
                return
            running = self._begin(peer, message.xid, False, now_ns)
        running.bytes_received += size
        running.progress_ns = now_ns
        self._outrank(message.digest)
        reply = Accept(self._own_id, self._boot, message.xid, self._digest(), self._staged())
        running.bytes_sent += self._post(reply, peer, "control")
        self._meet(running, message, now_ns)

    def on_accept(self, message: Accept, size: int, now_ns: int) -> None:
        """The peer takes my proposal."""
        exchange = self._find(message.sender, message.xid, size, now_ns)
        if exchange is not None and exchange.opened_by_me:
            self._outrank(message.digest)
            self._meet(exchange, message, now_ns)

    def on_refuse(self, message: Refuse, size: int, now_ns: int) -> None:
        """The peer does not want to exchange now, or knows nothing of this exchange."""
        exchange = self._find(message.sender, message.xid, size, now_ns)
        if exchange is None:
            return
        if exchange.accepted:
            self._fail(exchange, message.reason, now_ns)
        else:
            self._drop(exchange)
            self._rendezvous.refused(message.sender, now_ns)

    def _begin(self, peer: str, xid: int, opened_by_me: bool, now_ns: int) -> Exchange:
        exchange = Exchange(peer, xid, opened_by_me, now_ns, now_ns, asked_ns=now_ns, useful_ns=now_ns)
        self.active[peer] = exchange
        self._rendezvous.started(peer)
        return exchange

    def _meet(self, exchange: Exchange, message: Open | Accept, now_ns: int) -> None:
        """Both digests are known: offer what the peer lacks, and see what I lack."""
        if not exchange.accepted:
            exchange.accepted = True
            exchange.useful_ns = now_ns
            self._emit(ExchangeStarted(exchange.peer, exchange.opened_by_me))
            exchange.theirs = {robot: (epoch, revision) for robot, epoch, revision in message.digest}
            if self._takes_maps(exchange.peer):
                self._count_whole(exchange, self._own_id)
        held = {robot: (epoch, revision) for robot, epoch, revision in message.digest}
        staged = {robot: (epoch, revision) for robot, epoch, revision in message.staged}
        for robot in self._store.digest():
            if robot != exchange.peer and self._takes_maps(exchange.peer):
                self._offer(exchange, robot, held.get(robot, NOTHING), staged.get(robot))
        self._settle(exchange, now_ns)

    def _count_whole(self, exchange: Exchange, robot: str) -> None:
        snapshot = self._store.newest(robot)
        if snapshot is not None:
            exchange.whole[robot] = snapshot

    # -- giving ----------------------------------------------------------------------------------------------------

    def _offer(self, exchange: Exchange, robot: str, held: Version, staged: Version | None) -> bool:
        finish = staged if self._config.exchange_budget_bytes else None
        manifest = manifest_for(self._store, self._own_id, exchange.xid, robot, held, finish)
        if manifest is None:
            return False
        exchange.offer(manifest)
        if robot not in exchange.whole:
            self._count_whole(exchange, robot)
        exchange.bytes_sent += self._post(manifest, exchange.peer, "control")
        return True

    def on_ask(self, message: Ask, size: int, now_ns: int) -> None:
        """The peer asks what it lacks of one map."""
        exchange = self._find(message.sender, message.xid, size, now_ns)
        if exchange is None:
            self._answer_late(message.sender, message.xid)
        elif not self._offer(exchange, message.robot, (message.epoch, message.base), None):
            self._give_no_more(exchange)

    def on_get(self, message: Get, size: int, now_ns: int) -> None:
        """The peer asks for items of a manifest."""
        exchange = self._find(message.sender, message.xid, size, now_ns)
        if exchange is None:
            self._answer_late(message.sender, message.xid)
            return
        offered = exchange.offered.get((message.robot, message.epoch, message.base, message.target))
        if offered is None:
            if not self._offer(exchange, message.robot, (message.epoch, message.base), None):
                self._give_no_more(exchange)
            return
        for chunk in chunks_for(self._store, offered, message, self._config):
            budget = self._config.exchange_budget_bytes
            if budget and exchange.served and exchange.served + len(chunk.packed) > budget:
                self._give_no_more(exchange)
                return
            sent = self._post(chunk, exchange.peer, "bulk")
            exchange.served += sent
            exchange.useful_ns = now_ns
            exchange.bytes_sent += sent

    def _give_no_more(self, exchange: Exchange) -> None:
        exchange.budget_spent = True
        message = Done(self._own_id, exchange.xid, GIVE_NO_MORE)
        exchange.bytes_sent += self._post(message, exchange.peer, "control")

    # -- taking ----------------------------------------------------------------------------------------------------

    def on_manifest(self, message: Manifest, size: int, now_ns: int) -> None:
        """The peer tells what I lack of one map; raises ``WireError`` where that makes no sense."""
        exchange = self._find(message.sender, message.xid, size, now_ns)
        if exchange is None or not self._wants(exchange.peer, message.robot, (message.epoch, message.target)):
            return
        check_manifest(message, self._config)
        pull = exchange.pulls.setdefault(message.robot, Pull(message.robot))
        if self._is_at_work(pull, message):
            return  # heard twice; or two questions crossed, and following both answers would never end
        self._pulling[message.robot] = exchange.peer
        if self._store.base_of(message) is None:
            pull.manifest = None
            self._ask(exchange, message.robot)
            return
        pull.manifest = message
        self._go_on(exchange, pull, now_ns)

    def _is_at_work(self, pull: Pull, other: Manifest) -> bool:
        """Return whether items of a manifest as new as the other one, and still of use, are on their way."""
        current = pull.manifest
        if current is None or not pull.asked or self._store.base_of(current) is None:
            return False
        return (current.epoch, current.target) >= (other.epoch, other.target)

    def on_chunk(self, message: Chunk, size: int, now_ns: int) -> None:
        """Some of what I asked for; raises ``WireError`` where it is not what it says."""
        exchange = self._find(message.sender, message.xid, size, now_ns)
        pull = None if exchange is None else exchange.pulls.get(message.robot)
        if exchange is None or pull is None:
            return
        waiting = len(pull.asked)
        exchange.tiles += len(take_chunk(pull, message, self._store))
        if len(pull.asked) < waiting:
            exchange.useful_ns = now_ns
        if not pull.asked:
            self._go_on(exchange, pull, now_ns)

    def _go_on(self, exchange: Exchange, pull: Pull, now_ns: int) -> None:
        """Put the snapshot in place if it is whole, else ask for more of it."""
        if pull.manifest is None:
            return
        changed = self._store.try_commit(pull.manifest)
        if changed is None:
            get = next_get(pull, self._store, self._own_id, exchange.xid, self._config)
            if get is not None:
                exchange.bytes_sent += self._post(get, exchange.peer, "control")
                return
            self._store.staging.pop(pull.robot, None)  # it cannot be put together: begin this map again another time
        else:
            manifest = pull.manifest
            self._emit(MapUpdated(pull.robot, manifest.epoch, manifest.target, changed, exchange.peer))
        del exchange.pulls[pull.robot]
        self._release(exchange.peer, pull.robot)
        if changed is None:
            self._fail(exchange, "a snapshot did not fit together", now_ns)
        else:
            self._settle(exchange, now_ns)

    def _ask(self, exchange: Exchange, robot: str) -> None:
        epoch, revision = self._store.version(robot)
        question = Ask(self._own_id, exchange.xid, robot, epoch, revision)
        exchange.bytes_sent += self._post(question, exchange.peer, "control")

    def _wants(self, peer: str, robot: str, version: Version) -> bool:
        if robot == self._own_id or self._mode == "mapper" or version <= self._store.version(robot):
            return False
        return self._store.may_take(robot) and self._pulling.get(robot, peer) == peer

    # -- ending ----------------------------------------------------------------------------------------------------

    def on_done(self, message: Done, size: int, now_ns: int) -> None:
        """The peer holds all it wanted, or gives no more."""
        exchange = self._find(message.sender, message.xid, size, now_ns)
        if exchange is None:
            if message.code != LONG_DONE:  # or two robots would tell each other for ever
                self._answer_late(message.sender, message.xid)
            return
        if message.code == GIVE_NO_MORE:
            exchange.budget_spent = True
            exchange.theirs.clear()
            for robot in list(exchange.pulls):
                del exchange.pulls[robot]
                self._release(exchange.peer, robot)
        else:
            exchange.peer_done = True
        self._settle(exchange, now_ns)

    def _settle(self, exchange: Exchange, now_ns: int) -> None:
        """Tell the peer when I hold all it had; close when both do."""
        if not exchange.accepted:
            return
        open_maps = [robot for robot, version in exchange.theirs.items() if self._wants(exchange.peer, robot, version)]
        if exchange.pulls or open_maps:
            return
        if not exchange.is_done:
            exchange.is_done = True
            self._say_done(exchange)
        if exchange.peer_done:
            self._close(exchange, True)
            self._rendezvous.done(exchange.peer, now_ns)
            reason = "budget spent" if exchange.budget_spent else "complete"
            self._emit(ExchangeDone(*_costs(exchange, now_ns), reason))

    def _say_done(self, exchange: Exchange) -> None:
        exchange.bytes_sent += self._post(Done(self._own_id, exchange.xid, HOLD_ALL), exchange.peer, "control")

    def on_tick(self, now_ns: int) -> None:
        """Ask again after silence; give up after too much of it."""
        for exchange in list(self.active.values()):
            if now_ns - exchange.progress_ns > self._config.stall_timeout_s * 1e9:
                self._fail(exchange, "no answer" if not exchange.accepted else "the peer fell silent", now_ns)
            elif now_ns - exchange.useful_ns > PATIENCE * self._config.stall_timeout_s * 1e9:
                self._fail(exchange, "no progress", now_ns)
            elif now_ns - max(exchange.progress_ns, exchange.asked_ns) > exchange.retry_ns(self._config):
                exchange.asked_ns = now_ns
                exchange.retries += 1
                self._ask_again(exchange, now_ns)

    def _ask_again(self, exchange: Exchange, now_ns: int) -> None:
        if not exchange.accepted:
            self._send_open(exchange)
            return
        for robot, version in exchange.theirs.items():
            if self._wants(exchange.peer, robot, version) and robot not in exchange.pulls:
                self._ask(exchange, robot)
        for pull in list(exchange.pulls.values()):
            if pull.manifest is None or self._store.base_of(pull.manifest) is None:
                pull.manifest = None
                self._ask(exchange, pull.robot)
            else:
                self._go_on(exchange, pull, now_ns)
        if exchange.is_done:
            self._say_done(exchange)
        else:
            self._settle(exchange, now_ns)

    def abort(self, peer: str, reason: str, now_ns: int) -> None:
        """End the exchange with a peer that is out of reach."""
        if peer in self.active:
            self._fail(self.active[peer], reason, now_ns)

    def _fail(self, exchange: Exchange, reason: str, now_ns: int) -> None:
        self._close(exchange, False)
        self._rendezvous.failed(exchange.peer, now_ns)
        self._emit(ExchangeFailed(*_costs(exchange, now_ns), reason))

    def _close(self, exchange: Exchange, complete: bool) -> None:
        self._drop(exchange)
        self._over[exchange.peer, exchange.xid] = complete
        while len(self._over) > REMEMBERED:
            self._over.popitem(last=False)

    def _drop(self, exchange: Exchange) -> None:
        self.active.pop(exchange.peer, None)
        for robot in exchange.pulls:
            self._release(exchange.peer, robot)
        self._rendezvous.peers[exchange.peer].is_busy = False

    def _release(self, peer: str, robot: str) -> None:
        if self._pulling.get(robot) == peer:
            del self._pulling[robot]

    def _answer_late(self, peer: str, xid: int) -> None:
        """Answer a question about an exchange that is over here."""
        if self._over.get((peer, xid)):
            self._post(Done(self._own_id, xid, LONG_DONE), peer, "control")
        else:
            self._post(Refuse(self._own_id, xid, "that exchange is over"), peer, "control")

    # -- small -----------------------------------------------------------------------------------------------------

    def _find(self, peer: str, xid: int, size: int, now_ns: int) -> Exchange | None:
        exchange = self.active.get(peer)
        if exchange is None or exchange.xid != xid:
            return None
        exchange.bytes_received += size
        exchange.progress_ns, exchange.retries = now_ns, 0
        return exchange

    def _send_open(self, exchange: Exchange) -> None:
        message = Open(self._own_id, self._boot, exchange.xid, self._digest(), self._staged())
        exchange.bytes_sent += self._post(message, exchange.peer, "control")

    def _digest(self) -> list[tuple[str, int, int]]:
        return [(robot, *version) for robot, version in self._store.digest().items()]

    def _staged(self) -> list[tuple[str, int, int]]:
        return [(robot, *version) for robot, version in self._store.staged().items()]

    def _outrank(self, digest: list[tuple[str, int, int]]) -> None:
        for robot, epoch, revision in digest:
            if robot == self._own_id:
                self._store.outrank((epoch, revision))


def _costs(exchange: Exchange, now_ns: int) -> tuple[str, int, int, int, int, int, float]:
    return (
        exchange.peer,
        exchange.bytes_sent,
        exchange.bytes_received,
        sum(snapshot.full_bytes[0] for snapshot in exchange.whole.values()),
        sum(snapshot.full_bytes[1] for snapshot in exchange.whole.values()),
        exchange.tiles,
        (now_ns - exchange.started_ns) / 1e9,
    )
