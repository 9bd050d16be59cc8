"""What peers claim to hold of the own map, when that is above the own version: maps of the robot's earlier lives.

A robot that restarts from nothing may label its map below what teammates hold from its last life, and they would take
none of it. It labels its map above that version, but not on anyone's word: where the team has keys, the peer must bring
the own signature for the version it claims. Without keys nobody can prove anything: the first ``MOST_UNPROVEN`` claims
are believed, and who still holds more than the robot admits is offered the robot's map whole (``disowned`` there).
"""

from __future__ import annotations

from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.exchange.exchange import Exchange
from mrslam.comms.wire.messages import Accept, Ask, Manifest, Open, Version

MOST_UNPROVEN = 8
"""Claims without a signature that a robot follows in one life, in a team without keys. Each costs a new epoch, in which
teammates align its map again; honest ones come from as many earlier lives as teammates have seen the last of."""


class OwnMapClaims:
    """Follows claims about the own map, or asks for their proof."""

    def __init__(self, context: ExchangeContext) -> None:
        """Start with none heard."""
        self._context = context
        self._followed = 0

    def hear(self, exchange: Exchange, digest: Open | Accept) -> None:
        """Take a peer's digest: go above its version of the own map, or with team keys ask for the proof of it."""
        context = self._context
        exchange.claim = None
        claim = {robot: (epoch, revision) for robot, epoch, revision in digest.digest}.get(context.own_id)
        if claim is None or not context.store.is_outranked_by(claim):
            return
        if context.store.seal is not None:
            exchange.claim = claim
            self.ask(exchange)
        elif self._followed < MOST_UNPROVEN:
            self._followed += 1
            context.store.outrank(claim)

    def ask(self, exchange: Exchange) -> None:
        """Ask for the manifest of the version claimed, which bears its signature, with as few items as can be."""
        if exchange.claim is not None:
            epoch, revision = exchange.claim
            question = Ask(self._context.own_id, exchange.xid, self._context.own_id, epoch, max(revision - 1, 0))
            exchange.bytes_sent += self._context.out.post(question, exchange.peer, "control")

    def on_manifest(self, exchange: Exchange, message: Manifest) -> Version | None:
        """Return the version of the own map that a peer has proven to hold, once the own one is labelled above it.

        None where no proof was asked for, or the own map is above it already.

        Raises ``WireError`` where the robot's own signature is missing or wrong.
        """
        if exchange.claim is None:
            return None
        exchange.claim = None
        self._context.staged_maps.check_proof(message)
        held = (message.epoch, message.target)
        return held if self._context.store.outrank(held) else None
