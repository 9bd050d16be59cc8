"""Which pair of maps is aligned next."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from mrslam.agent.config import AgentConfig
from mrslam.agent.effects import AlignJob
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.belief import UNCONFIRMED, PairBelief
from mrslam.alignment import Prior
from mrslam.merge import Pair
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

PRIOR_COVARIANCE = np.diag([0.5**2, 0.5**2, 0.1**2])
"""Covariance of a merged pair's transform, m^2 and rad^2: corrections of both maps may have moved it since. Its
standard deviations are the limits within which two estimates confirm each other (``StabilityCheck``)."""


class Schedule:
    """Chooses from beliefs and maps passed in; it has no state of its own."""

    def __init__(self, own_id: str, config: AgentConfig) -> None:
        """Take the robot's id, whose own map comes first, and how often pairs are tried again."""
        self.own_id, self.config = own_id, config

    def next_job(
        self,
        beliefs: Mapping[Pair, PairBelief],
        maps: Mapping[str, KnownMap],
        T_team_map: Mapping[str, Transform],
        now_ns: int,
    ) -> AlignJob | None:
        """Return the pair most worth aligning: untried first, then the own map's, then the longest waiting."""
        due = [
            (self._rank(pair, belief), pair)
            for pair, belief in beliefs.items()
            if self._is_due(belief, (maps[pair[0]], maps[pair[1]]), now_ns)
        ]
        if not due:
            return None
        a, b = min(due)[1]
        belief, map_a, map_b = beliefs[a, b], maps[a], maps[b]
        prior = None
        if self._may_follow(belief, (map_a, map_b)) and a in T_team_map and b in T_team_map:
            prior = Prior(se2.between(T_team_map[a], T_team_map[b]), PRIOR_COVARIANCE)
        versions, areas = (map_a.version, map_b.version), (map_a.area_m2, map_b.area_m2)
        trails = (map_a.trail, map_b.trail)
        return AlignJob(a, b, map_a.grid, map_b.grid, prior, versions, areas, belief.attempts, trails)

    def _rank(self, pair: Pair, belief: PairBelief) -> tuple[int, int, int]:
        tried = -1 if belief.last is None else belief.last.t_ns
        return (0 if belief.last is None else 1, 0 if self.own_id in pair else 1, tried)

    def _is_due(self, belief: PairBelief, maps: tuple[KnownMap, KnownMap], now_ns: int) -> bool:
        last = belief.last
        if last is None:
            return True
        waited_ns = now_ns - last.t_ns
        if waited_ns < self.config.align_interval_s * 1e9:
            return False
        if belief.reason == UNCONFIRMED:
            return True
        if last.versions == (maps[0].version, maps[1].version):
            return False
        if belief.alignment is None:
            return _grown(maps, last.area_m2, self.config.align_growth)
        return waited_ns / 1e9 >= self.config.realign_interval_s or self._outgrown(belief, maps)

    def _may_follow(self, belief: PairBelief, maps: tuple[KnownMap, KnownMap]) -> bool:
        """Return whether a prior where the pair was found is enough, which is cheap; else everything is searched."""
        return belief.alignment is not None and belief.search.accepted and not self._outgrown(belief, maps)

    def _outgrown(self, belief: PairBelief, maps: tuple[KnownMap, KnownMap]) -> bool:
        """Return whether a merged pair's maps have grown so much since the last search that another place may fit."""
        growth = self.config.realign_growth if belief.search.accepted else self.config.align_growth
        return _grown(maps, belief.search.area_m2, growth)


def _grown(maps: tuple[KnownMap, KnownMap], before_m2: tuple[float, float], share: float) -> bool:
    return any(one.area_m2 >= (1.0 + share) * area for one, area in zip(maps, before_m2, strict=True))
