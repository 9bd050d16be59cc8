"""Exchanges that are over: late questions about them are answered, so that the peer need not wait for silence."""

from __future__ import annotations

from collections import OrderedDict

from mrslam.comms.exchange.outgoing import Outgoing
from mrslam.comms.wire.messages import ALREADY_OVER, Ask, Done, Get, Message, Refuse

REMEMBERED = 256
"""Exchanges remembered: one with each of ``max_robots`` peers at its default; bounds memory alone."""


class PastExchanges:
    """The last exchanges, by (peer, xid), and whether each was completed."""

    def __init__(self, own_id: str, out: Outgoing) -> None:
        """Start with none."""
        self._own_id, self._out = own_id, out
        self._completed: OrderedDict[tuple[str, int], bool] = OrderedDict()

    def __contains__(self, peer_and_xid: tuple[str, int]) -> bool:
        """Return whether this exchange is over."""
        return peer_and_xid in self._completed

    def add(self, peer: str, xid: int, *, completed: bool) -> None:
        """Remember how an exchange ended; the oldest is forgotten."""
        self._completed[peer, xid] = completed
        while len(self._completed) > REMEMBERED:
            self._completed.popitem(last=False)

    def answer(self, peer: str, xid: int) -> None:
        """Say that the exchange is over here: completed, or given up (or never heard of)."""
        completed = self._completed.get((peer, xid))
        done = Done(self._own_id, xid, ALREADY_OVER)
        self._out.post(done if completed else Refuse(self._own_id, xid, "that exchange is over"), peer, "control")

    def answer_stray(self, message: Message) -> None:
        """Answer a question or an end of an exchange that is over here; other messages of it need no answer."""
        match message:
            case Ask() | Get():
                self.answer(message.sender, message.xid)
            case Done() if message.code != ALREADY_OVER:  # or two robots would answer each other for ever
                self.answer(message.sender, message.xid)
