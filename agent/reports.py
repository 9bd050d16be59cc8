"""When the event "known" is due: reporting how much is known takes fused maps, which costs their change."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from mrslam.agent.known_map import KnownMap

REPORT_NS, REPORT_MOST_NS = 10_000_000_000, 300_000_000_000
"""Least and most time between two reports, nanoseconds."""
GROWTH = 0.1
"""Share by which the known area of all maps together has changed where a report comes before the most time is over.
Measured on two robots' logs of a quarter of an hour: 0.05 gives 68 reports, one every ``REPORT_NS`` 180."""


class KnowledgeReports:
    """Remembers what was known when it was last reported."""

    def __init__(self) -> None:
        """Nothing was reported yet."""
        self._t_ns: int | None = None
        self._area_m2 = 0.0
        self._placed: frozenset[str] = frozenset()

    def are_due(self, maps: Mapping[str, KnownMap], placed: Collection[str], now_ns: int) -> bool:
        """Return whether a report is due, and take it as made; ``placed`` : the robots with a place in the team map."""
        if self._t_ns is not None and now_ns - self._t_ns < REPORT_NS:
            return False
        area_m2, robots = sum(known.area_m2 for known in maps.values()), frozenset(placed)
        is_news = robots != self._placed or abs(area_m2 - self._area_m2) > GROWTH * self._area_m2
        if self._t_ns is not None and not is_news and now_ns - self._t_ns < REPORT_MOST_NS:
            return False
        self._t_ns, self._area_m2, self._placed = now_ns, area_m2, robots
        return True
