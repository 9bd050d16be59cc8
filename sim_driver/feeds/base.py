"""What every recorded log gives."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from mrslam.spatial import Scan
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, eq=False)
class Reading:
    """One scan and what the wheels said when it was taken."""

    scan: Scan
    T_odom_base: Transform | None
    """``(3,)`` raw odometry, in a frame that starts anywhere; None where the log has none."""


class Feed(Protocol):
    """A recorded log, read once and kept in file order: the order of motion, whatever the stamps say."""

    @property
    def readings(self) -> Sequence[Reading]:
        """All scans, in file order."""

    @property
    def notes(self) -> Sequence[str]:
        """What was odd in the file, one plain sentence each: dropped lines, stamps that run backward, ..."""
