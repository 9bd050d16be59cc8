"""The current quality of each link: measured with beacons, or given by a radio model or a trace."""

from __future__ import annotations

from collections.abc import Callable

from mrslam.comms.effects import LinkChanged
from mrslam.comms.exchange.context import ExchangeContext
from mrslam.comms.neighbours.link_quality import LinkMonitor

EXACT = 1e-9
"""A ``link_step`` of 0 records every change, but none of rounding."""


class LinkStates:
    """Keeps the quality of every link and emits :class:`LinkChanged` where one moved."""

    def __init__(self, context: ExchangeContext, abort: Callable[[str, str, int], None]) -> None:
        """Start without links; ``abort(peer, reason, now_ns)`` ends the exchange with a peer that is out of reach."""
        self._context, self._abort = context, abort
        self.monitor = LinkMonitor(context.config)
        self._is_measured = context.config.link_source == "measured"
        self._reported: dict[str, float] = {}
        self._given: dict[str, float] = {}  # peer -> quality by the model or trace, also of peers out of sight
        self._period_ns = round(context.config.beacon_period_s * 1e9)
        self._judge_ns = 0

    def give(self, peer: str, quality: float, now_ns: int, *, is_here: bool) -> None:
        """Take a link's quality (0..1) from a radio model or a trace; nothing happens where links are measured."""
        if not self._is_measured:
            self._given[peer] = min(max(float(quality), 0.0), 1.0) if quality == quality else 0.0  # NaN: no link
            if is_here:
                self._set(peer, self._given[peer], now_ns)

    def on_seen(self, peer: str, now_ns: int) -> None:
        """A peer came into sight: a quality given for its link before applies from now on."""
        if peer in self._given:
            self._set(peer, self._given[peer], now_ns)

    def on_lost(self, peer: str, now_ns: int) -> None:
        """A peer is gone, and its link with it."""
        self._set(peer, 0.0, now_ns)
        self._reported.pop(peer, None)
        self.monitor.forget(peer)
        self._context.rendezvous.forget(peer)

    def judge(self, here: Callable[[str], bool], now_ns: int) -> None:
        """Update the measured qualities once a beacon period; ``here(peer)``: whether the peer is in sight."""
        if now_ns < self._judge_ns:
            return
        self._judge_ns = max(self._judge_ns, now_ns - self._period_ns) + self._period_ns
        if self._is_measured:
            for peer, quality in self.monitor.update(now_ns).items():
                if here(peer):
                    self._set(peer, quality, now_ns)

    def _set(self, peer: str, quality: float, now_ns: int) -> None:
        rendezvous, step = self._context.rendezvous, max(self._context.config.link_step, EXACT)
        changed = rendezvous.on_quality(peer, quality, now_ns)
        reported = self._reported.get(peer)
        if changed or reported is None or abs(quality - reported) >= step:
            self._reported[peer] = quality
            self._context.out.emit(LinkChanged(peer, quality, rendezvous.peers[peer].state))
        if quality <= 0.0 and not self._is_measured:
            self._abort(peer, "link lost", now_ns)
