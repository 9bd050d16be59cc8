"""All exchanges of one robot, at most one with each peer: opens them, answers, asks again after silence, ends them.

``map_sender`` and ``map_receiver`` do what happens in between. No I/O, no clock.
"""

from __future__ import annotations

from mrslam.comms.effects import ExchangeDone, ExchangeFailed, ExchangeStarted
from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.exchange.exchange import Exchange
from mrslam.comms.exchange.map_receiver import MapReceiver
from mrslam.comms.exchange.map_sender import MapSender
from mrslam.comms.exchange.own_map_claims import OwnMapClaims
from mrslam.comms.exchange.past_exchanges import PastExchanges
from mrslam.comms.maps.whole_sizes import WholeSizes
from mrslam.comms.wire.messages import (
    ALREADY_OVER,
    GIVE_NO_MORE,
    HOLD_ALL,
    Accept,
    Ask,
    Chunk,
    Done,
    Get,
    Manifest,
    Open,
    Refuse,
)

PATIENCE = 4
"""An exchange without progress, though messages come, has failed after this multiple of ``stall_timeout_s``: chunks
that are sent again (after 4 ``retry_s``) are part of that."""
XID_STEP = 2654435761
"""Odd, about 2^32 over the golden ratio (Knuth's multiplicative hash): exchange ids of two boots next to each other lie
far apart."""

ExchangeMessage = Accept | Refuse | Ask | Manifest | Get | Chunk | Done
"""Messages of an exchange after its Open."""


class Exchanges:
    """The exchanges in progress."""

    def __init__(self, context: ExchangeContext) -> None:
        """Start with none."""
        self._context = context
        self._sender, self._receiver = MapSender(context), MapReceiver(context)
        self.active: dict[str, Exchange] = {}
        """By peer."""
        self.unplaced: list[str] | None = None
        """Robots whose maps are held and not placed, to say so; None: not known."""
        self.placed_by: dict[str, tuple[bool, int]] = {}
        """By peer: whether it has placed the own map, as it said last, and when, nanoseconds."""
        self._claims = OwnMapClaims(context)
        self._past = PastExchanges(context.own_id, context.out)
        self._whole = WholeSizes()
        self._count = 0

    # -- beginning -------------------------------------------------------------------------------------------------

    def open(self, peer: str, now_ns: int) -> None:
        """Propose an exchange to a peer."""
        self._count += 1
        xid = (self._context.boot * XID_STEP + self._count) & 0xFFFFFFFF
        self._send_digest(Open, self._begin(peer, xid, True, now_ns))

    def on_open(self, message: Open, size: int, now_ns: int) -> None:
        """A peer proposes an exchange: accept, or say why not."""
        peer, running = message.sender, self.active.get(message.sender)
        if (peer, message.xid) in self._past:
            self._past.answer(peer, message.xid)
            return
        if running is not None and running.xid != message.xid:
            if running.opened_by_me and not running.accepted:
                if self._context.own_id < peer:
                    return  # both opened at once: the lesser id's proposal stands
                self._drop(running)
            else:
                self._fail(running, "the peer began another", now_ns)
            running = None
        if running is None:
            reason = self._context.rendezvous.may_answer(peer)
            if reason is not None:
                self._context.out.post(Refuse(self._context.own_id, message.xid, reason), peer, "control")
                return
            running = self._begin(peer, message.xid, False, now_ns)
        running.bytes_received += size
        running.progress_ns = now_ns
        self._claims.hear(running, message)
        self._send_digest(Accept, running)
        self._on_digest(running, message, now_ns)

    def _begin(self, peer: str, xid: int, opened_by_me: bool, now_ns: int) -> Exchange:
        exchange = Exchange(peer, xid, opened_by_me, now_ns, now_ns, asked_ns=now_ns, useful_ns=now_ns)
        self.active[peer] = exchange
        self._context.rendezvous.started(peer)
        return exchange

    def _on_digest(self, exchange: Exchange, message: Open | Accept, now_ns: int) -> None:
        """Both digests are known: send manifests of what the peer lacks, and Done if nothing is wanted from it."""
        held, unplaced = {robot for robot, *_ in message.digest}, message.unplaced
        is_placed = unplaced is not None and self._context.own_id in held.difference(unplaced)
        self.placed_by[exchange.peer] = is_placed, now_ns
        if not exchange.accepted:
            exchange.accepted = True
            exchange.useful_ns = now_ns
            self._context.out.emit(ExchangeStarted(exchange.peer, exchange.opened_by_me, tuple(unplaced or ())))
            theirs = (*message.digest, *(message.saved or ()))
            exchange.theirs = {name: (epoch, revision) for name, epoch, revision in theirs}
            self._sender.begin(exchange)
        self._sender.offer_all(exchange, message)
        self._settle(exchange, now_ns)

    def _send_digest(self, kind: type[Open | Accept], exchange: Exchange) -> None:
        store = self._context.store
        held = [(robot, *version) for robot, version in store.digest().items()]
        staged = [(robot, *version) for robot, version in self._context.staged_maps.staged().items()]
        saved = None
        if self._context.shares_saved_maps:
            saved = [(name, *version) for name, version in store.saved_digest().items()]
        if exchange.shown is None:
            exchange.shown = store.version(exchange.peer)
        message = kind(self._context.own_id, self._context.boot, exchange.xid, held, staged, saved, self.unplaced)
        exchange.bytes_sent += self._context.out.post(message, exchange.peer, "control")

    # -- in between ------------------------------------------------------------------------------------------------

    def on_message(self, message: ExchangeMessage, size: int, now_ns: int) -> None:
        """Take a message of an exchange; raises ``WireError`` where it makes no sense."""
        exchange = self.active.get(message.sender)
        if exchange is None or exchange.xid != message.xid:
            self._past.answer_stray(message)
            return
        exchange.bytes_received += size
        exchange.progress_ns, exchange.retries = now_ns, 0
        match message:
            case Accept():
                if exchange.opened_by_me:
                    self._claims.hear(exchange, message)
                    self._on_digest(exchange, message, now_ns)
            case Refuse():
                self._on_refuse(exchange, message, now_ns)
            case Ask():
                self._sender.on_ask(exchange, message)
            case Get():
                self._sender.on_get(exchange, message, now_ns)
            case Manifest() | Chunk():
                self._take(exchange, message, now_ns)
            case Done():
                self._on_done(exchange, message, now_ns)

    def _take(self, exchange: Exchange, message: Manifest | Chunk, now_ns: int) -> None:
        try:
            if message.robot == self._context.own_id:
                self._on_own_map(exchange, message)
            elif isinstance(message, Manifest):
                self._receiver.on_manifest(exchange, message)
                exchange.is_done &= not exchange.pulls  # it wants more again
            else:
                self._receiver.on_chunk(exchange, message, now_ns)
        finally:
            self._fail_or_settle(exchange, now_ns)

    def _on_own_map(self, exchange: Exchange, message: Manifest | Chunk) -> None:
        """The peer proves which earlier version of the own map it holds: offer it the own one, labelled above that."""
        held = self._claims.on_manifest(exchange, message) if isinstance(message, Manifest) else None
        if held is not None and self._sender.offer(exchange, self._context.own_id, held):
            # It wants more now: a Done that it has sent, or that is on its way, does not count.
            exchange.skips_done, exchange.peer_done = not exchange.peer_done, False

    def _fail_or_settle(self, exchange: Exchange, now_ns: int) -> None:
        if exchange.broken:
            self._fail(exchange, exchange.broken, now_ns)
        else:
            self._settle(exchange, now_ns)

    def on_tick(self, now_ns: int) -> None:
        """Ask again after silence; give up after too much of it."""
        config = self._context.config
        for exchange in list(self.active.values()):
            if now_ns - exchange.progress_ns > config.stall_timeout_s * 1e9:
                self._fail(exchange, "no answer" if not exchange.accepted else "the peer fell silent", now_ns)
            elif now_ns - exchange.useful_ns > PATIENCE * config.stall_timeout_s * 1e9:
                self._fail(exchange, "no progress", now_ns)
            elif now_ns - max(exchange.progress_ns, exchange.asked_ns) > exchange.retry_ns(config):
                exchange.asked_ns = now_ns
                exchange.retries += 1
                self._ask_again(exchange, now_ns)

    def _ask_again(self, exchange: Exchange, now_ns: int) -> None:
        if not exchange.accepted:
            self._send_digest(Open, exchange)
            return
        self._claims.ask(exchange)
        self._receiver.ask_again(exchange)
        if exchange.is_done and not exchange.broken:
            self._say_done(exchange)
        else:
            self._fail_or_settle(exchange, now_ns)

    # -- ending ----------------------------------------------------------------------------------------------------

    def _on_refuse(self, exchange: Exchange, message: Refuse, now_ns: int) -> None:
        """The peer does not want to exchange now, or does not know this exchange."""
        if exchange.accepted:
            self._fail(exchange, message.reason, now_ns)
        else:
            self._drop(exchange)
            self._context.rendezvous.refused(message.sender, now_ns)

    def _on_done(self, exchange: Exchange, message: Done, now_ns: int) -> None:
        """The peer holds all it wanted, or gives no more."""
        if message.code == GIVE_NO_MORE:
            exchange.budget_spent = True
            exchange.theirs.clear()
            exchange.claim = None
            self._receiver.release(exchange)
        elif message.code == HOLD_ALL and exchange.skips_done:
            exchange.skips_done = False
        else:
            exchange.peer_done = True
        self._settle(exchange, now_ns)
        if message.code == ALREADY_OVER and self.active.get(exchange.peer) is exchange:
            self._fail(exchange, "it is over there", now_ns)  # and I want more: open another

    def _settle(self, exchange: Exchange, now_ns: int) -> None:
        """Send Done once nothing more is wanted from the peer; close the exchange once both have."""
        if not exchange.accepted or exchange.claim is not None or self._receiver.wants_more(exchange):
            return
        if not exchange.is_done:
            exchange.is_done = True
            self._say_done(exchange)
        if exchange.peer_done:
            self._close(exchange, completed=True)
            self._context.rendezvous.done(exchange.peer, now_ns)
            reason = "budget spent" if exchange.budget_spent else "complete"
            self._context.out.emit(ExchangeDone(exchange.peer, exchange.costs(self._whole, now_ns), reason))

    def _say_done(self, exchange: Exchange) -> None:
        message = Done(self._context.own_id, exchange.xid, HOLD_ALL)
        exchange.bytes_sent += self._context.out.post(message, exchange.peer, "control")

    def abort(self, peer: str, reason: str, now_ns: int) -> None:
        """End the exchange with a peer that is out of reach."""
        if peer in self.active:
            self._fail(self.active[peer], reason, now_ns)

    def _fail(self, exchange: Exchange, reason: str, now_ns: int) -> None:
        self._close(exchange, completed=False)
        self._context.rendezvous.failed(exchange.peer, now_ns)
        if exchange.accepted:  # else ExchangeStarted was never emitted
            self._context.out.emit(ExchangeFailed(exchange.peer, exchange.costs(self._whole, now_ns), reason))

    def _close(self, exchange: Exchange, *, completed: bool) -> None:
        self._drop(exchange)
        self._past.add(exchange.peer, exchange.xid, completed=completed)

    def _drop(self, exchange: Exchange) -> None:
        self.active.pop(exchange.peer, None)
        self._receiver.release(exchange)
        self._context.rendezvous.peers[exchange.peer].is_busy = False
