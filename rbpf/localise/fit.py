"""How well a saved map shows what a robot sees, and from when on the robot is not where it thinks it is."""

from __future__ import annotations

from dataclasses import dataclass

from mrslam.rbpf.front_end.health import BAD_FIT, FIT_RANGE, SEEN_LEAST

MEMORY_M, MEMORY_S = 2.0, 20.0
"""Way, and time at rest, over which the fit is averaged (to 1/e), metres and seconds: furniture that moved and people
that stand around are passed within it."""
UNSEEN_SHARE = 0.25
"""Share of that with which a scan counts of which the map shows next to nothing: it is no sign of a wrong place, but
the longer it lasts, the less is known of the place. From a fit of 1 the robot is lost after 2.4 m, so after 10 m."""
WHEELS_SHARE = 0.5
"""Share with which a metre counts over which wheels contradict the matches: as one that fits nowhere."""
LOST = 0.3
"""Fit below which the robot is lost: as where 45 % of the beams on known floor end at walls, for good."""


@dataclass
class Fit:
    """The share of beams that end at a saved map's walls, as a health (0..1), averaged over way and time."""

    value: float = 1.0
    shown: float = 1.0
    """Share of beams that end where the map shows anything, averaged likewise."""

    def follow(self, inliers: float, conflicts: float, way_m: float, elapsed_s: float) -> None:
        """Take one scan: shares of its beams at walls and on free floor, and the way and time since the one before."""
        shown = inliers + conflicts
        is_seen = shown > SEEN_LEAST
        fit = min(max((inliers / shown - BAD_FIT) / FIT_RANGE, 0.0), 1.0) if is_seen else 0.0
        share = min(way_m / MEMORY_M + max(elapsed_s, 0.0) / MEMORY_S, 1.0) * (1.0 if is_seen else UNSEEN_SHARE)
        self.value += share * (fit - self.value)
        self.shown += share * (shown - self.shown)

    def contradict(self) -> None:
        """Take that the wheels contradict the matches of the last metre, which fit in part only."""
        self.value -= WHEELS_SHARE * self.value

    @property
    def is_lost(self) -> bool:
        """Whether the robot is not where it thinks it is, or the map does not show where it is."""
        return self.value < LOST

    @property
    def words(self) -> str:
        """Why it is lost."""
        if self.shown < 0.5:
            return f"the saved map does not show what it sees: {100 * (1.0 - self.shown):.0f} % lie beyond it"
        return "what it sees does not fit the saved map where it should be"
