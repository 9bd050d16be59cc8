"""Where a mapper doubted its pose: what a person should look at in a map, since nobody else will."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

DOUBTFUL_BELOW = 0.5
"""Health of a doubtful pose, as ``mrslam.rbpf.UpdateInfo`` has it."""
APART_S = 5.0
"""Doubts less than this apart are one stretch, seconds."""
TOLD_MOST = 5
"""Most stretches that the line names: more do not fit in it."""


@dataclass(frozen=True)
class Doubts:
    """The doubtful scans of a log."""

    scans: int
    share: float
    """Of all scans that were used, 0..1."""
    stretches_s: list[list[float]]
    """``[from, to]`` in seconds since the log's first scan."""

    @property
    def text(self) -> str:
        """One line for a person, empty without doubtful scans."""
        if not self.scans:
            return ""
        spans = [f"{begin:.0f}-{end:.0f}" for begin, end in self.stretches_s[:TOLD_MOST]]
        more = len(self.stretches_s) - len(spans)
        return (
            f"doubtful where the robot was for {self.scans} scans ({100 * self.share:.1f} %), in the log's seconds "
            f"{', '.join(spans)}{f' and {more} stretches more' if more else ''}: look at the map there"
        )


def find_doubts(stamps_ns: NDArray[np.int64], health: NDArray[np.float64], begin_ns: int) -> Doubts:
    """Return the doubtful ones of the used scans.

    ``stamps_ns (S,)`` and ``health (S,)`` of each, as it was reported; ``begin_ns`` : stamp of the log's first scan,
    which need not be one of them.
    """
    doubtful = np.flatnonzero(health < DOUBTFUL_BELOW)
    if not doubtful.size:
        return Doubts(0, 0.0, [])
    seconds = (stamps_ns[doubtful] - begin_ns) / 1e9
    parts = np.split(seconds, 1 + np.flatnonzero(np.abs(np.diff(seconds)) > APART_S))
    stretches = [[round(float(part.min()), 1), round(float(part.max()), 1)] for part in parts]
    return Doubts(int(doubtful.size), round(doubtful.size / health.size, 4), stretches)
