"""What went over the link to one teammate, and what full maps would have cost."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mrslam.comms import ExchangeDone


@dataclass
class LinkStats:
    """Sums over all completed exchanges with one peer, in bytes, as counted by one side."""

    exchanges: int = 0
    bytes_sent: int = 0
    bytes_full_lz4: int = 0
    bytes_full_raw: int = 0

    def add(self, done: ExchangeDone) -> None:
        """Count one exchange."""
        self.exchanges += 1
        self.bytes_sent += done.costs.bytes_sent
        self.bytes_full_lz4 += done.costs.bytes_full_lz4
        self.bytes_full_raw += done.costs.bytes_full_raw

    def row(self) -> dict[str, Any]:
        """Return the sums as plain JSON values."""
        return dict(vars(self))
