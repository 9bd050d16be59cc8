"""What every recorded log offers, and what makes a format of logs known."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from mrslam.spatial import Scan
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True, eq=False)
class Reading:
    """One scan and the odometry at its stamp."""

    scan: Scan
    T_odom_base: Transform | None
    """``(3,)`` raw odometry, in a frame that starts anywhere; None where the log has none."""


class Feed(Protocol):
    """A recorded log, read once and kept in file order: the order of motion, whatever the stamps are."""

    @property
    def readings(self) -> Sequence[Reading]:
        """All scans, in file order."""

    @property
    def notes(self) -> Sequence[str]:
        """What was odd in the file, one plain sentence each: dropped lines, stamps that run backward, ..."""


@dataclass(frozen=True)
class Format:
    """A format of recorded logs: its name, its files, and its reader."""

    name: str
    suffixes: tuple[str, ...]
    """Suffixes of its files, before ``.gz``."""
    read: Callable[[Path, bool], Feed]
    """Reads a log (path, salvage: use what is whole of a file that was cut off); raises ``InputError``."""
    folder_file: str | None = None
    """A folder that holds a file of this name is a log of this format, None where logs are single files."""
