"""Which items of a manifest were sent and may still be on their way.

A receiver asks again after ``retry_s`` of silence, and a chunk may take longer than that on a slow link. If every
question were answered in full, the link would fill with copies, and the map would never be complete.
"""

from __future__ import annotations

from collections.abc import Sequence


class InFlight:
    """Items of one manifest that were sent, in their order."""

    def __init__(self, now_ns: int) -> None:
        """Nothing has been sent."""
        self._order: dict[int, int] = {}  # item -> its place in the order of all sendings, from 1
        self._sent = self._arrived = 0
        self.moved_ns = now_ns
        """When progress was last seen, or all was sent again."""

    def due(self, wanted: Sequence[int], now_ns: int, patience_ns: int) -> list[int]:
        """Return which of the items ``wanted``, those that the peer lacks, are to be sent now; they count as sent.

        A lane keeps the order of its messages, so an item is lost where one that was sent after it has arrived; and all
        are lost where nothing has arrived for ``patience_ns``.
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
