"""What of a manifest has been sent and may still be on its way.

Who waits for chunks asks again after a second of silence, and a chunk may take longer than that. Sent again each time,
chunks would fill the link with what has arrived already, and the map would never be there.
"""

from __future__ import annotations

from collections.abc import Sequence


class InFlight:
    """Items of one manifest that were sent, in their order."""

    def __init__(self, now_ns: int) -> None:
        """Nothing has been sent."""
        self._order: dict[int, int] = {}
        self._sent = self._arrived = 0
        self.moved_ns = now_ns
        """When progress was last seen, or all was sent again."""

    def due(self, wanted: Sequence[int], now_ns: int, patience_ns: int) -> list[int]:
        """Return which of the items that the peer has not got are to be sent now; they count as sent.

        What goes one way arrives in its order, so an item is lost where one that was sent after it has arrived; and all
        are where nothing has arrived for ``patience_ns``.
        """
        lacking = set(wanted)
        arrived = [order for item, order in self._order.items() if item not in lacking]
        if len(arrived) > self._arrived:
            self._arrived, self.moved_ns = len(arrived), now_ns
        newest = max(arrived, default=0)
        is_stuck = now_ns - self.moved_ns >= patience_ns
        if is_stuck:
            self.moved_ns = now_ns
        due = [item for item in wanted if is_stuck or self._order.get(item, 0) <= newest]
        for item in due:
            self._sent += 1
            self._order[item] = self._sent
        return due
