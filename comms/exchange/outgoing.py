"""Effects waiting for the shell, and counters of bytes sent and messages dropped."""

from __future__ import annotations

from collections import Counter, defaultdict
from dataclasses import dataclass

from mrslam.comms.effects import Dropped, Effect, ExchangeCosts, ExchangeDone, ExchangeFailed, Lane, Send
from mrslam.comms.milestones import is_milestone
from mrslam.comms.wire.frames import team_tag
from mrslam.comms.wire.messages import Message, encode


@dataclass
class Totals:
    """Sums over the exchanges with one peer, bytes."""

    sent: int = 0
    received: int = 0
    full_lz4: int = 0
    full_raw: int = 0

    def add(self, costs: ExchangeCosts, *, completed: bool) -> None:
        """Count one exchange; a failed one cost its bytes and replaces no whole map."""
        self.sent += costs.bytes_sent
        self.received += costs.bytes_received
        if completed:
            self.full_lz4 += costs.bytes_full_lz4
            self.full_raw += costs.bytes_full_raw


class Outgoing:
    """Collects effects until the shell takes them. Does no I/O."""

    def __init__(self, team: str) -> None:
        """Start with nothing to send; messages are framed for this team."""
        self.team_tag = team_tag(team)
        self.dropped: Counter[str] = Counter()
        """Bad messages, by what was bad."""
        self.totals: defaultdict[str, Totals] = defaultdict(Totals)
        """What the exchanges with each peer cost so far."""
        self.bytes_sent: Counter[str] = Counter()
        """Bytes sent on each lane."""
        self._effects: list[Effect] = []

    def post(self, message: Message, to: str | None, lane: Lane) -> int:
        """Send a message to a peer (None: to all); return its size, bytes."""
        payload = encode(message, self.team_tag)
        self.bytes_sent[lane] += len(payload)
        self._effects.append(Send(to, payload, lane))
        return len(payload)

    def emit(self, effect: Effect) -> None:
        """Report an event to the shell."""
        if isinstance(effect, ExchangeDone | ExchangeFailed):
            self.totals[effect.peer].add(effect.costs, completed=isinstance(effect, ExchangeDone))
        self._effects.append(effect)

    def drop(self, kind: str, sender: str | None) -> None:
        """Count a bad message; report the first of its kind, the 2nd, 4th, 8th and so on."""
        self.dropped[kind] += 1
        count = self.dropped[kind]
        if is_milestone(count):
            self._effects.append(Dropped(kind, count, sender))

    def take(self) -> list[Effect]:
        """Return the effects since the last call."""
        taken, self._effects = self._effects, []
        return taken
