"""Sends maps in exchanges: offers what the peer lacks, and answers what it asks for."""

from __future__ import annotations

from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.exchange.exchange import Exchange
from mrslam.comms.exchange.in_flight import InFlight
from mrslam.comms.exchange.pull import offer_of
from mrslam.comms.maps.chunks import make_chunks
from mrslam.comms.maps.manifests import make_manifest
from mrslam.comms.maps.store import NOTHING
from mrslam.comms.wire.bitmask import from_mask
from mrslam.comms.wire.fields import is_saved
from mrslam.comms.wire.messages import GIVE_NO_MORE, Accept, Ask, Done, Get, Open, Version

RESEND = 4
"""Chunks of which none arrives are sent again after this multiple of ``retry_s``: after the receiver's own questions,
which come after 1, 2 and 4 times ``retry_s``, have had the time to be answered."""


class MapSender:
    """Sends maps, within the bytes allowed for one exchange."""

    def __init__(self, context: ExchangeContext) -> None:
        """Send the maps of this robot's store."""
        self._context = context

    def begin(self, exchange: Exchange) -> None:
        """Count the own map among those whose whole size is compared with the costs, even where it is not offered."""
        if self._context.takes_maps(exchange.peer):
            self._count_whole(exchange, self._context.own_id)

    def offer_all(self, exchange: Exchange, digest: Open | Accept) -> None:
        """Send the peer a manifest of each map of which it lacks something, but its own; saved maps last."""
        if not self._context.takes_maps(exchange.peer):
            return
        held = {robot: (epoch, revision) for robot, epoch, revision in digest.digest}
        staged = {robot: (epoch, revision) for robot, epoch, revision in digest.staged}
        for robot in self._context.store.digest():
            if robot != exchange.peer:
                self.offer(exchange, robot, held.get(robot, NOTHING), staged.get(robot))
        if digest.saved is not None and self._context.shares_saved_maps:
            saved = {name: (epoch, revision) for name, epoch, revision in digest.saved}
            for name in self._context.store.saved_digest():
                self.offer(exchange, name, saved.get(name, NOTHING))

    def on_ask(self, exchange: Exchange, message: Ask) -> None:
        """The peer asks what it lacks of one map."""
        self._offer_or_end(exchange, message)

    def on_get(self, exchange: Exchange, message: Get, now_ns: int) -> None:
        """The peer asks for items of a manifest."""
        store, config = self._context.store, self._context.config
        offer = offer_of(message)
        offered = exchange.offered.get(offer)
        if offered is None or store.at(message.robot, message.epoch, message.target) is None:
            self._offer_or_end(exchange, message)  # a map disowned since, or a version no longer in the history
            return
        flow = exchange.in_flight.setdefault(offer, InFlight(now_ns))
        wanted = from_mask(message.mask, len(offered.blocks) + len(offered.rows))
        due = flow.due(wanted, now_ns, round(RESEND * config.retry_s * 1e9))
        exchange.useful_ns = max(exchange.useful_ns, flow.moved_ns)
        budget = config.exchange_budget_bytes
        for chunk in make_chunks(store, offered, due, config):
            if budget and exchange.served and exchange.served + len(chunk.packed) > budget:
                self._give_no_more(exchange)
                return
            sent = self._context.out.post(chunk, exchange.peer, "bulk")
            exchange.served += sent
            exchange.useful_ns = now_ns
            exchange.bytes_sent += sent

    def _offer_or_end(self, exchange: Exchange, question: Ask | Get) -> None:
        if not self.offer(exchange, question.robot, (question.epoch, question.base)):
            self._give_no_more(exchange)

    def offer(self, exchange: Exchange, robot: str, held: Version, staged: Version | None = None) -> bool:
        """Send a manifest of what one who holds version ``held`` lacks of a robot's map; return whether that is any.

        ``staged``: what the peer has in part. Who holds more of the own map than this robot admits is offered it whole.
        """
        context = self._context
        if is_saved(robot) and not context.shares_saved_maps:
            return False
        if robot == context.own_id and context.store.seal is None and held > context.store.version(robot):
            held = NOTHING
        finish = staged if context.config.exchange_budget_bytes else None
        manifest = make_manifest(context.store, context.own_id, exchange.xid, robot, held, finish)
        if manifest is None:
            return False
        exchange.offer(manifest)
        if robot not in exchange.whole:
            self._count_whole(exchange, robot)
        exchange.bytes_sent += context.out.post(manifest, exchange.peer, "control")
        return True

    def _count_whole(self, exchange: Exchange, robot: str) -> None:
        snapshot = self._context.store.newest(robot)
        if snapshot is not None:
            exchange.whole[robot] = snapshot

    def _give_no_more(self, exchange: Exchange) -> None:
        exchange.budget_spent = True
        message = Done(self._context.own_id, exchange.xid, GIVE_NO_MORE)
        exchange.bytes_sent += self._context.out.post(message, exchange.peer, "bulk")  # not before the last chunk
