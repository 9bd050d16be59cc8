"""When to exchange with whom: a pure state machine over peers, link qualities and time.

A peer's link is weak (0) or strong (1), with hysteresis. An exchange is due on a strong link
when ``exchange_timeout_s`` has passed since the last completed one, and the pause after a failed one is over. The peer
that has waited longest goes first. In that time a robot exchanges with some of the peers it has met before, not with
all of them: the others hear the news from these, and what a robot sends does not grow with the team.
"""

from __future__ import annotations

import heapq
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from mrslam.comms.config import CommsConfig

WEAK, STRONG = 0, 1
ANSWERER_DELAY_NS = 500_000_000
"""The robot with the greater id waits this much longer, nanoseconds, so that the two do not open at once: five ticks of
0.1 s."""
BUSY_PAUSE_NS = 500_000_000
"""Pause after a peer refused, nanoseconds, times 1 to 2 at random."""
MOST_PEERS = 8192
"""Peers remembered, in sight or not: above any ``max_robots``; bounds memory alone."""
NEVER_NS = -(2**62)
"""Before every time: no pause."""


@dataclass
class PeerState:
    """What the rendezvous knows of one peer."""

    quality: float = 0.0
    state: int = WEAK
    is_busy: bool = False
    """Whether an exchange with it is in progress."""
    strong_since_ns: int = 0
    done_ns: int | None = None
    """When the last exchange was completed."""
    turn: int = 0
    """When an exchange last began, in the order of all exchanges."""
    paused_until_ns: int = NEVER_NS
    failures: int = 0
    """Failed exchanges in a row."""


@dataclass
class Rendezvous:
    """Returns when an exchange is due and whether one may be answered; sends nothing itself."""

    own_id: str
    config: CommsConfig
    rng: np.random.Generator
    peers: dict[str, PeerState] = field(default_factory=dict)
    _turn: int = 0

    def on_quality(self, peer: str, quality: float, now_ns: int) -> bool:
        """Take a link's quality; return whether its state changed."""
        known = self.peers.setdefault(peer, PeerState())
        known.quality = quality
        bound = self.config.link_threshold - (self.config.link_hysteresis if known.state == STRONG else 0.0)
        state = STRONG if quality >= bound and quality > 0.0 else WEAK
        if state == known.state:
            return False
        known.state = state
        if state == STRONG:
            known.strong_since_ns = now_ns
        return True

    def forget(self, peer: str) -> None:
        """Drop what is known of a peer's link; when it was last met is kept."""
        known = self.peers.pop(peer, None)
        if known is not None:
            known.quality, known.state, known.is_busy = 0.0, WEAK, False
            self.peers[peer] = known  # the newest comes last
            if len(self.peers) > MOST_PEERS:
                gone = (one for one, state in self.peers.items() if state.quality == 0.0 and not state.is_busy)
                del self.peers[next(gone)]

    def on_restart(self, peer: str) -> None:
        """The peer restarted and holds nothing: the next exchange is due at once."""
        self.peers.pop(peer, None)

    def due(self, now_ns: int, is_worth: Callable[[str], bool] = lambda peer: True) -> list[str]:
        """Return the peers to open an exchange with now, longest waiting first, as many as may run at once."""
        free = self.config.max_parallel_exchanges - sum(known.is_busy for known in self.peers.values())
        if free <= 0:
            return []
        again_ns = self._again_ns()
        ready = [
            peer
            for peer, known in self.peers.items()
            if not known.is_busy and now_ns >= self._due_ns(peer, again_ns) and is_worth(peer)
        ]
        ready.sort(key=lambda peer: (self.peers[peer].turn, peer))
        again = [peer for peer in ready if self.peers[peer].done_ns is not None]
        met_ns = (known.done_ns for known in self.peers.values() if known.done_ns is not None and not known.is_busy)
        begun = sum(known.is_busy for known in self.peers.values())
        room = self.config.exchanges_per_timeout - begun - sum(now_ns < ns + self._timeout_ns for ns in met_ns)
        wait = set(again[max(room, 0) :])
        return [peer for peer in ready if peer not in wait][:free]

    def _again_ns(self) -> int:
        """Return from when on a peer that was met before may be met again: so many were met in the last timeout."""
        most = self.config.exchanges_per_timeout
        done_ns = heapq.nlargest(most, (known.done_ns for known in self.peers.values() if known.done_ns is not None))
        return NEVER_NS if len(done_ns) < most else done_ns[-1] + self._timeout_ns

    @property
    def _timeout_ns(self) -> int:
        return round(self.config.exchange_timeout_s * 1e9)

    def _due_ns(self, peer: str, again_ns: int) -> float:
        known = self.peers[peer]
        if known.state != STRONG:
            return float("inf")
        since_done = known.strong_since_ns
        if known.done_ns is not None:
            since_done = max(since_done, known.done_ns + self._timeout_ns, again_ns)
        answerer_delay_ns = ANSWERER_DELAY_NS if self.own_id > peer else 0
        return max(since_done + answerer_delay_ns, known.paused_until_ns)

    def next_exchange_s(self, peer: str, now_ns: int) -> float:
        """Return in how many seconds an exchange with a peer is due; 0 now, inf while its link is weak."""
        if peer not in self.peers:
            return float("inf")
        return max(0.0, (self._due_ns(peer, self._again_ns()) - now_ns) / 1e9)

    def may_answer(self, peer: str) -> str | None:
        """Return None where an exchange that the peer opens is accepted, else the reason for Refuse."""
        known = self.peers.get(peer)
        if known is None or known.quality < self.config.link_threshold - self.config.link_hysteresis:
            return "weak link"
        if sum(other.is_busy for other in self.peers.values()) >= 2 * self.config.max_parallel_exchanges:
            return "busy"
        return None

    def started(self, peer: str) -> None:
        """An exchange with a peer began."""
        known = self.peers.setdefault(peer, PeerState())
        self._turn += 1
        known.is_busy, known.turn = True, self._turn

    def refused(self, peer: str, now_ns: int) -> None:
        """The peer refused: no failure, open again after a short pause."""
        known = self.peers.setdefault(peer, PeerState())
        known.is_busy = False
        known.paused_until_ns = now_ns + round(BUSY_PAUSE_NS * (1.0 + self.rng.random()))

    def done(self, peer: str, now_ns: int) -> None:
        """An exchange with a peer was completed."""
        known = self.peers.setdefault(peer, PeerState())
        known.is_busy, known.failures, known.done_ns, known.paused_until_ns = False, 0, now_ns, NEVER_NS

    def failed(self, peer: str, now_ns: int) -> None:
        """An exchange broke off: pause, twice as long with each further failure, with some jitter."""
        known = self.peers.setdefault(peer, PeerState())
        pause_s = min(self.config.backoff_s * 2.0 ** min(known.failures, 20), self.config.backoff_max_s)
        known.failures += 1
        known.is_busy = False
        known.paused_until_ns = now_ns + round(pause_s * 1e9 * (1.0 + 0.2 * self.rng.random()))
