"""How good a link is: the share of beacons that get through, both ways (OLSR, RFC 3626; ETX)."""

from __future__ import annotations

from dataclasses import dataclass, field

from mrslam.comms.config import CommsConfig

MIN_EXPECTED = 8
"""A link is judged as if at least this many beacons had been due, the least ``beacon_window``: one beacon heard is no
proof of a good link."""
SILENCE_GRACE = 1.5
"""Beacon periods that may pass before a beacon not heard counts as lost: one, and half of one for jitter."""
STEADY_BEACONS = 16
"""A link is steady when this many beacons in a row (or the whole window) arrived: at 10 % loss that happens in one of
five (0.9^16)..."""
STEADY_NLQ = 0.95
"""... and the neighbour says that it receives at least this share of mine."""
LEAST_PERIOD_NS = 1_000_000
"""Least ``comms.beacon_period_s``, nanoseconds: no division by a neighbour's zero."""


@dataclass(frozen=True)
class HeardBeacon:
    """What a neighbour's beacon says of the link to it."""

    seq: int
    sent_ns: int
    """When, on the neighbour's clock."""
    period_ns: int
    """Until its next one."""
    nlq: float | None
    """Share of my beacons that it receives, 0..1; None where this beacon does not say."""


class BeaconWindow:
    """Which of the last W beacons of one neighbour arrived in time, as the bits of one integer (newest lowest)."""

    __slots__ = (
        "_bits",
        "_current_best_ns",
        "_expected",
        "_heard_in_turn",
        "_heard_ns",
        "_mask",
        "_previous_best_ns",
        "_seq",
        "_size",
    )

    def __init__(self, size: int) -> None:
        """Start with nothing heard."""
        self._size, self._mask = size, (1 << size) - 1
        self._bits = self._expected = self._heard_in_turn = 0
        self._seq: int | None = None
        self._heard_ns = 0
        # Clocks of two robots differ, so lateness is measured against the least delay of the recent beacons: of the
        # last W beacons counted in full (previous), and of those heard since (current, ``_heard_in_turn`` of them).
        self._previous_best_ns: int | None = None
        self._current_best_ns: int | None = None

    def hear(self, seq: int, sent_ns: int, now_ns: int, deadline_ns: int) -> None:
        """Count a beacon that arrived now; one more than ``deadline_ns`` later than the quickest counts as lost."""
        delay_ns = now_ns - sent_ns
        is_late = self._lateness_ns(delay_ns) > deadline_ns
        if self._seq is None:
            self._seq, self._expected, self._bits = seq, 1, 0 if is_late else 1
        elif seq > self._seq:
            gap = min(seq - self._seq, self._size)
            self._bits = ((self._bits << gap) | (0 if is_late else 1)) & self._mask
            self._expected = min(self._expected + gap, self._size)
            self._seq = seq
        elif self._seq - seq < self._expected and not is_late:
            self._bits |= 1 << (self._seq - seq)
        self._heard_ns = max(self._heard_ns, now_ns)

    def _lateness_ns(self, delay_ns: int) -> int:
        """Return by how much a delay (with the unknown clock offset in it) exceeds the least of the recent ones."""
        if self._heard_in_turn >= self._size:  # forget the quickest of long ago: routes change, clocks drift
            self._previous_best_ns, self._current_best_ns, self._heard_in_turn = self._current_best_ns, None, 0
        self._heard_in_turn += 1
        self._current_best_ns = delay_ns if self._current_best_ns is None else min(self._current_best_ns, delay_ns)
        best = (
            self._current_best_ns
            if self._previous_best_ns is None
            else min(self._previous_best_ns, self._current_best_ns)
        )
        return delay_ns - best

    def quality(self, now_ns: int, period_ns: int) -> float:
        """Return LQ, the share of the due beacons that arrived; silence counts as loss at the sender's own pace."""
        if self._seq is None:
            return 0.0
        missed = min(max(int((now_ns - self._heard_ns) / period_ns - SILENCE_GRACE + 1.0), 0), self._size)
        received = (self._bits & (self._mask >> missed)).bit_count()
        return received / max(min(self._expected + missed, self._size), MIN_EXPECTED)

    def is_steady(self, now_ns: int, period_ns: int) -> bool:
        """Return whether none of the last beacons was lost, and none is overdue."""
        newest = self._mask & ((1 << STEADY_BEACONS) - 1)
        return self._bits & newest == newest and now_ns - self._heard_ns <= (1.0 + SILENCE_GRACE) * period_ns


@dataclass
class _Neighbour:
    """What is measured of the link to one neighbour."""

    window: BeaconWindow
    period_ns: int = 1_000_000_000
    nlq: float = 0.0
    nlq_ns: int | None = None
    quality: float = 0.0
    reported: int = -1
    """Number of my beacon that last reported this neighbour's LQ."""


@dataclass
class LinkMonitor:
    """LQ, NLQ and smoothed quality of every neighbour."""

    config: CommsConfig
    _neighbours: dict[str, _Neighbour] = field(default_factory=dict)
    _turn: int = 0

    def hear(self, peer: str, beacon: HeardBeacon, now_ns: int) -> None:
        """Take a neighbour's beacon."""
        neighbour = self._neighbours.get(peer)
        if neighbour is None:
            neighbour = self._neighbours[peer] = _Neighbour(BeaconWindow(self.config.beacon_window))
        neighbour.period_ns = max(beacon.period_ns, LEAST_PERIOD_NS)
        neighbour.window.hear(beacon.seq, beacon.sent_ns, now_ns, round(self.config.beacon_deadline_s * 1e9))
        if beacon.nlq is not None:
            neighbour.nlq, neighbour.nlq_ns = beacon.nlq, now_ns

    def forget(self, peer: str) -> None:
        """Drop a neighbour that left or restarted."""
        self._neighbours.pop(peer, None)

    def lq(self, peer: str, now_ns: int) -> float:
        """Return the share of a neighbour's beacons that I receive."""
        neighbour = self._neighbours.get(peer)
        return 0.0 if neighbour is None else neighbour.window.quality(now_ns, neighbour.period_ns)

    def update(self, now_ns: int) -> dict[str, float]:
        """Return every neighbour's smoothed LQ x NLQ after one more smoothing step; call it once a beacon period."""
        qualities = {}
        # An NLQ not renewed for two windows of beacons at the calm pace counts as 0.
        stale_ns = 2e9 * self.config.beacon_window * self.config.beacon_period_s * self.config.beacon_calm_factor
        for peer, neighbour in self._neighbours.items():
            nlq = neighbour.nlq if neighbour.nlq_ns is not None and now_ns - neighbour.nlq_ns < stale_ns else 0.0
            raw = neighbour.window.quality(now_ns, neighbour.period_ns) * nlq
            neighbour.quality += self.config.link_smoothing * (raw - neighbour.quality)
            qualities[peer] = neighbour.quality
        return qualities

    def is_calm(self, now_ns: int) -> bool:
        """Return whether nobody is heard, or no link loses beacons: then a lower rate measures as well."""
        return all(
            (neighbour.nlq >= STEADY_NLQ and neighbour.window.is_steady(now_ns, neighbour.period_ns))
            or neighbour.window.quality(now_ns, neighbour.period_ns) == 0.0
            for neighbour in self._neighbours.values()
        )

    def report(self, now_ns: int) -> list[tuple[str, float]]:
        """Return the LQ of the neighbours whose turn it is, for the next beacon; bounded in number."""
        turn = sorted(self._neighbours, key=lambda peer: (self._neighbours[peer].reported, peer))
        chosen = turn[: self.config.beacon_neighbours]
        self._turn += 1
        for peer in chosen:
            self._neighbours[peer].reported = self._turn
        return [(peer, self.lq(peer, now_ns)) for peer in chosen]
