"""Many maps: finding what fits without trying every pair.

Neighbours by name are tried first; what fits forms clusters. The largest cluster's fused map is then tried against all
others, those that fit join it, and so on until none does. What joins is aligned with the members it shares most wall
with, so that the team graph gets the pairs' own evidence, and loops.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise

import numpy as np

from mrslam.alignment import Alignment, Prior, Rejection
from mrslam.merge.batch.pair_aligner import Job, PairAligner, first
from mrslam.merge.batch.vetting import vet
from mrslam.merge.graph.carried import moved, seen_from
from mrslam.merge.graph.edges import Pair, pair_of
from mrslam.merge.grids.agreement import Walls, compare
from mrslam.merge.team import TeamMap
from mrslam.spatial import se2

PARTNERS = 2
"""Members of a cluster that a joining map is aligned with: two close a loop that checks both."""
NEIGHBOURS = 4
"""Members of a finished cluster that each member is aligned with: bounds the alignments to four a map."""
DENSE_ROUNDS = 2
"""Times a finished cluster is densified: after the first the maps lie better, which shows further overlaps."""
GROWTH = 1.1
"""Two clusters are tried again when their joint known area has grown by this factor, as ``agent.align_growth``."""
LEAST_WALL_M = 4.0
"""Least common wall for aligning two members, metres: with less, alignment would reject them."""
FOLLOW = np.diag([0.4**2, 0.4**2, 0.06**2])
"""Covariance of a member's pose in the fused map, m^2 and rad^2: about the defaults of ``merge.loop_tolerance_*``."""


@dataclass
class ClusterSearch:
    """Grows clusters of maps that fit; what it finds is in ``pairs``."""

    pairs: PairAligner
    _tried: dict[Pair, float] = field(default_factory=dict)
    """By two clusters' first members: their known area together when they were tried, square metres."""

    def run(self) -> None:
        """Try clusters' fused maps against each other, beginning with that of most maps, until nothing more fits."""
        names = sorted(self.pairs.grids)
        self.pairs.align_pairs([(a, b, None) for a, b in pairwise(names)])
        clusters = self.pairs.clusters(names)
        while True:
            clusters.sort(key=lambda one: (-len(one.T_team_map), -one.grid.known_area_m2(), first(one)))
            main, joined = self._next_join(clusters)
            if not joined:
                break
            clusters = [cluster for cluster in clusters if cluster is not main and cluster not in joined]
            clusters += self.pairs.clusters(x for cluster in (main, *joined) for x in cluster.T_team_map)
            self.pairs.report(len(names) - len(clusters), len(names))

        for cluster in clusters:
            parts = [cluster]
            for _ in range(DENSE_ROUNDS if len(cluster.T_team_map) > 2 else 0):
                parts = self._densify(parts[0]) + parts[1:]
            for part in parts:
                vet(self.pairs, part)

    def _next_join(self, clusters: Sequence[TeamMap]) -> tuple[TeamMap, list[TeamMap]]:
        """Return a cluster and those that fit it: as wholes, else where a single member of theirs fits."""
        for main in clusters:
            joined = self._grow(main, [other for other in clusters if self._is_due(main, other)])
            if joined:
                return main, joined
        several = [cluster for cluster in clusters if len(cluster.T_team_map) > 1]
        for main, other in combinations(several, 2):
            members = [self.pairs.cluster([name]) for name in other.T_team_map]
            if self._grow(main, [one for one in members if self._is_due(main, one)]):
                return main, [other]
        return clusters[0], []

    def _densify(self, cluster: TeamMap) -> list[TeamMap]:
        """Align members with those they share most wall with, for loops that check the cluster and make it rigid.

        Return the cluster, and what falls off it.
        """
        place = cluster.T_team_map
        walls = {name: self.pairs.walls(name) for name in place}
        shared = {(a, b): self._shared_m(walls, place, a, b) for a in place for b in place if a < b}
        wanted: set[Pair] = set()
        for name in place:
            mine = sorted((pair for pair in shared if name in pair), key=lambda pair: (-shared[pair], pair))
            wanted |= {pair for pair in mine[:NEIGHBOURS] if shared[pair] >= LEAST_WALL_M}
        self.pairs.align_pairs(self._follow(place, sorted(wanted - self.pairs.rejections.keys())))
        return self.pairs.clusters(place)

    def _is_due(self, main: TeamMap, other: TeamMap) -> bool:
        """Whether two clusters were not tried yet, or have grown since; notes that they are tried now."""
        if main is other:
            return False
        area = main.grid.known_area_m2() + other.grid.known_area_m2()
        pair = pair_of(first(main), first(other))
        if area < GROWTH * self._tried.get(pair, 0.0):
            return False
        self._tried[pair] = area
        return not (len(main.T_team_map) == len(other.T_team_map) == 1 and pair in self.pairs.rejections)

    def _grow(self, main: TeamMap, others: Sequence[TeamMap]) -> list[TeamMap]:
        """Return the clusters that fit the main one; the alignments that join them are kept in ``edges``."""
        found = self.pairs.align_grids(main.grid, [other.grid for other in others])
        fits: list[tuple[TeamMap, Alignment]] = []
        for other, result in zip(others, found, strict=True):
            if isinstance(result, Alignment):
                fits.append((other, result))
            else:
                pair = pair_of(first(main), first(other))
                self.pairs.rejections.setdefault(pair, _of_clusters(result, main, other))
        place = dict(main.T_team_map)
        for other, fit in fits:
            place |= {name: se2.compose(fit.T_a_b, T) for name, T in other.T_team_map.items()}
        walls = {name: self.pairs.walls(name) for name in place} if fits else {}
        candidates = [self._ranked(walls, place, main, other) for other, _ in fits]
        jobs = [job for ranked in candidates for job in self._follow(place, ranked)]
        accepted = set(self.pairs.align_pairs(jobs))
        for (other, fit), ranked in zip(fits, candidates, strict=True):
            if not any(pair_of(a, b) in accepted for a, b in ranked):
                # Only with all members together is there wall enough: the evidence goes to the two that share most.
                a, b = ranked[0]
                own = moved(fit, se2.inverse(main.T_team_map[a]))
                self.pairs.keep(a, b, seen_from(own, other.T_team_map[b]))
        return [other for other, _ in fits]

    def _ranked(
        self, walls: Mapping[str, Walls], place: Mapping[str, se2.Transform], main: TeamMap, other: TeamMap
    ) -> list[tuple[str, str]]:
        """Return the pairs of two clusters' members to align: those that share most wall, a few for each newcomer."""
        shared = {(a, b): self._shared_m(walls, place, a, b) for a in main.T_team_map for b in other.T_team_map}
        ranked = sorted(shared, key=lambda pair: (-shared[pair], pair))
        most = PARTNERS * len(other.T_team_map)
        return ranked[:1] + [pair for pair in ranked[1:most] if shared[pair] >= LEAST_WALL_M]

    def _shared_m(self, walls: Mapping[str, Walls], place: Mapping[str, se2.Transform], a: str, b: str) -> float:
        """Return the wall that two placed maps agree on less what contradicts, metres."""
        near_m = self.pairs.config.contradiction_tolerance_m
        found = compare(walls[a], walls[b], se2.between(place[a], place[b]), near_m)
        return found.agree_m - found.against_m

    def _follow(self, place: Mapping[str, se2.Transform], pairs: Sequence[tuple[str, str]]) -> list[Job]:
        """Return the jobs that align placed maps, near where they are placed."""
        new = [(a, b) for a, b in pairs if pair_of(a, b) not in self.pairs.edges]
        return [(a, b, Prior(se2.between(place[a], place[b]), FOLLOW)) for a, b in new]


def _of_clusters(rejection: Rejection, one: TeamMap, other: TeamMap) -> Rejection:
    """Return the rejection of two clusters' fused maps, saying that it is about these."""
    counts = len(one.T_team_map), len(other.T_team_map)
    where = f"merged maps of {counts[0]} and {counts[1]} do not fit: " if max(counts) > 1 else ""
    return replace(rejection, reason=where + rejection.reason)
