"""Finding the alignments between many maps without trying every pair.

A few maps are tried pair by pair. Of many, neighbours by name are tried first; what fits forms clusters. The largest
cluster's fused map is then tried against all others, those that fit join it, and so on until none does. What joins is
aligned with the members it shares most wall with, so that the team graph gets the pairs' own evidence, and loops.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise

import numpy as np

from alignment import Alignment, Prior, Rejection, align
from merge.agreement import Walls, compare
from merge.config import MergeConfig
from merge.consistency import apart, components
from merge.edges import Pair, inverse_covariance, pair_of
from merge.graph import node_of
from merge.team import TeamMap, TeamMapper
from spatial import OccupancyGrid, se2

Progress = Callable[[int, int], None]
"""(alignments or maps done, in all)."""
ALL_PAIRS_UP_TO = 9
"""Up to so many maps every pair is tried."""
PARTNERS = 2
"""Members of a cluster that a map which joins it is aligned with."""
NEIGHBOURS = 4
"""Members of a finished cluster that each is aligned with."""
DENSE_ROUNDS = 2
"""How often; the second time the maps lie better, and overlaps are seen that were not."""
SURE = 0.75
"""An alignment of such confidence stands where the merged maps on both sides fit best there too, though not clearly."""
GROWTH = 1.1
"""Two clusters are tried again when their known area together has grown by this factor."""
LEAST_WALL_M = 4.0
"""Less wall in common is no reason to align two members."""
FOLLOW = np.diag([0.4**2, 0.4**2, 0.06**2])
"""How far a member's place in the fused map may be off, m^2 and rad^2."""


@dataclass
class PairSearch:
    """Aligns pairs of maps by id; remembers what came out."""

    grids: Mapping[str, OccupancyGrid]
    method: str
    pool: Executor
    config: MergeConfig
    progress: Progress | None = None
    edges: dict[Pair, Alignment] = field(default_factory=dict)
    """Accepted ``T_a_b``, a < b."""
    rejections: dict[Pair, Rejection] = field(default_factory=dict)
    """Why a pair does not fit; of two clusters that do not, under the pair of their first members."""
    tried: int = 0
    """Alignments computed."""
    _vetted: set[Pair] = field(default_factory=set)

    def every_pair(self, T_team_map: Mapping[str, se2.Transform]) -> None:
        """Try all pairs; those whose known poses lay them far apart are not tried."""
        names = sorted(self.grids)
        jobs = []
        for i, a in enumerate(names):
            for b in names[i + 1 :]:
                prior = self._prior(a, b, T_team_map)
                if prior is None or self._may_touch(a, b, prior):
                    jobs.append((a, b, prior))
        self._align(jobs, report=True)
        for group in components(names, self.edges):
            self._vet(self._cluster(group))

    def by_clusters(self) -> None:
        """Try clusters' fused maps against each other, beginning with that of most maps, until nothing more fits."""
        names = sorted(self.grids)
        self._align([(a, b, None) for a, b in pairwise(names)])
        clusters = [self._cluster(group) for group in components(names, self.edges)]
        clusters += [self._cluster([x]) for x in names if not any(x in cluster.T_team_map for cluster in clusters)]
        tried: dict[tuple[str, str], float] = {}
        while True:
            clusters.sort(key=lambda one: (-len(one.T_team_map), -one.grid.known_area_m2(), _first(one)))
            main, joined = self._next_join(clusters, tried)
            if not joined:
                break
            clusters = [cluster for cluster in clusters if cluster is not main and cluster not in joined]
            together = {x for cluster in (main, *joined) for x in cluster.T_team_map}
            while together:  # what does not hold together falls apart again
                cluster = self._cluster(sorted(together))
                clusters.append(cluster)
                together -= cluster.T_team_map.keys()
            if self.progress is not None:
                self.progress(len(names) - len(clusters), len(names))

        for cluster in clusters:
            for _ in range(DENSE_ROUNDS if len(cluster.T_team_map) > 2 else 0):
                cluster = self._densify(cluster)
            self._vet(cluster)

    def _vet(self, cluster: TeamMap) -> None:
        """Take back alignments that a cluster hangs on by itself where the merged maps on both sides do not fit."""
        if len(cluster.T_team_map) < 3:
            return
        for edge in sorted(cluster.edges, key=lambda edge: (edge.confidence, edge.pair)):
            sides = components(cluster.T_team_map, [other.pair for other in cluster.edges if other is not edge])
            if len(sides) < 2 or edge.pair in self._vetted:
                continue
            self._vetted.add(edge.pair)
            doubt = self._doubt(edge.confidence, sides, cluster.T_team_map)
            if doubt is not None:
                del self.edges[edge.pair]
                self.rejections[edge.pair] = doubt
                for side in sides:
                    self._vet(self._cluster(side))
                return

    def _doubt(
        self, confidence: float, sides: Sequence[Sequence[str]], place: Mapping[str, se2.Transform]
    ) -> Rejection | None:
        """Return why the two sides of an alignment do not fit as they are placed, or None where they do."""
        one, other = (self._cluster(side) for side in sides)
        found = align(one.grid, other.grid, method=self.method)
        self.tried += 1
        placed = se2.between(place[_first(one)], place[_first(other)])
        gap_m, gap_rad = (
            apart(placed, found.T_a_b, node_of(other.grid).centre_m) if found.T_a_b is not None else (np.inf, np.inf)
        )
        agrees = gap_m < self.config.loop_tolerance_m * 2 and gap_rad < self.config.loop_tolerance_rad * 2
        if agrees and (isinstance(found, Alignment) or confidence >= SURE):
            return None
        why = found.reason if isinstance(found, Rejection) else f"they fit better {gap_m:.1f} m away"
        reason = f"accepted by itself, but the merged maps of both sides speak against it: {why}"
        return Rejection(reason, found.confidence, found.evidence, found.method)

    def _next_join(
        self, clusters: Sequence[TeamMap], tried: dict[tuple[str, str], float]
    ) -> tuple[TeamMap, list[TeamMap]]:
        """Return a cluster and those that fit it: as wholes, else where a single member of theirs fits."""
        for main in clusters:
            joined = self._grow(main, [other for other in clusters if self._is_due(main, other, tried)])
            if joined:
                return main, joined
        several = [cluster for cluster in clusters if len(cluster.T_team_map) > 1]
        for main, other in combinations(several, 2):
            members = [self._cluster([name]) for name in other.T_team_map]
            if self._grow(main, [one for one in members if self._is_due(main, one, tried)]):
                return main, [other]
        return clusters[0], []

    def _densify(self, cluster: TeamMap) -> TeamMap:
        """Align members with those they share most wall with, for loops that check and stiffen the whole."""
        place = cluster.T_team_map
        walls = {name: Walls(self.grids[name]) for name in place}
        shared = {(a, b): self._shared_m(walls, place, a, b) for a in place for b in place if a < b}
        wanted: set[Pair] = set()
        for name in place:
            mine = sorted((pair for pair in shared if name in pair), key=lambda pair: (-shared[pair], pair))
            wanted |= {pair for pair in mine[:NEIGHBOURS] if shared[pair] >= LEAST_WALL_M}
        self._align(self._follow(place, sorted(wanted - self.rejections.keys())))
        return self._cluster(sorted(place))

    def _cluster(self, names: Sequence[str]) -> TeamMap:
        """Return the team map of the first of these maps and those of the others that hang on it."""
        mapper = TeamMapper(names[0], self.config)
        for name in names:
            mapper.set_map(name, self.grids[name])
        for pair, edge in sorted(self.edges.items()):
            if pair[0] in names and pair[1] in names:
                mapper.set_edge(*pair, edge)
        return mapper.team_map()

    def _is_due(self, main: TeamMap, other: TeamMap, tried: dict[tuple[str, str], float]) -> bool:
        """Whether two clusters were not tried yet, or have grown since; notes that they are tried now."""
        if main is other:
            return False
        area = main.grid.known_area_m2() + other.grid.known_area_m2()
        pair = pair_of(_first(main), _first(other))
        if area < GROWTH * tried.get(pair, 0.0):
            return False
        tried[pair] = area
        return not (len(main.T_team_map) == len(other.T_team_map) == 1 and pair in self.rejections)

    def _grow(self, main: TeamMap, others: Sequence[TeamMap]) -> list[TeamMap]:
        """Return the clusters that fit the main one; the alignments that join them are kept in ``edges``."""
        found = self.pool.map(lambda other: align(main.grid, other.grid, method=self.method), others)
        self.tried += len(others)
        fits: list[tuple[TeamMap, Alignment]] = []
        for other, result in zip(others, found, strict=True):
            if isinstance(result, Alignment):
                fits.append((other, result))
            else:
                pair = pair_of(_first(main), _first(other))
                self.rejections.setdefault(pair, _of_clusters(result, main, other))
        place = dict(main.T_team_map)
        for other, fit in fits:
            place |= {name: se2.compose(fit.T_a_b, T) for name, T in other.T_team_map.items()}
        walls = {name: Walls(self.grids[name]) for name in place} if fits else {}
        candidates = [self._ranked(walls, place, main, other) for other, _ in fits]
        jobs = [job for ranked in candidates for job in self._follow(place, ranked)]
        accepted = set(self._align(jobs))
        for (other, fit), ranked in zip(fits, candidates, strict=True):
            if not any(pair_of(a, b) in accepted for a, b in ranked):
                # Only with all members together is there wall enough: the evidence goes to the two that share most.
                a, b = ranked[0]
                own = _moved(fit, se2.inverse(main.T_team_map[a]))
                self._keep(a, b, _seen_from(own, se2.inverse(other.T_team_map[b])))
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
        near_m = self.config.contradiction_tolerance_m
        found = compare(walls[a], walls[b], se2.between(place[a], place[b]), near_m)
        return found.agree_m - found.against_m

    def _follow(
        self, place: Mapping[str, se2.Transform], pairs: Sequence[tuple[str, str]]
    ) -> list[tuple[str, str, Prior | None]]:
        """Return the jobs that align placed maps, near where they are placed."""
        new = [(a, b) for a, b in pairs if pair_of(a, b) not in self.edges]
        return [(a, b, Prior(se2.between(place[a], place[b]), FOLLOW)) for a, b in new]

    def _align(self, jobs: Sequence[tuple[str, str, Prior | None]], report: bool = False) -> list[Pair]:
        """Align pairs side by side; return those accepted, in the order of the jobs."""
        found = self.pool.map(
            lambda job: align(self.grids[job[0]], self.grids[job[1]], method=self.method, prior=job[2]), jobs
        )
        accepted = []
        for done, ((a, b, _), result) in enumerate(zip(jobs, found, strict=True), start=1):
            self.tried += 1
            if self._keep(a, b, result):
                accepted.append(pair_of(a, b))
            if report and self.progress is not None:
                self.progress(done, len(jobs))
        return accepted

    def _keep(self, a: str, b: str, result: Alignment | Rejection) -> bool:
        pair = pair_of(a, b)
        if isinstance(result, Rejection):
            self.rejections[pair] = result
            return False
        self.edges[pair] = result if (a, b) == pair else _turned(result)
        self.rejections.pop(pair, None)
        return True

    def _prior(self, a: str, b: str, T_team_map: Mapping[str, se2.Transform]) -> Prior | None:
        """Return what known starting poses say of a pair."""
        if a not in T_team_map or b not in T_team_map:
            return None
        sigma_m, sigma_rad = 2.0 * self.config.known_pose_sigma_m, 2.0 * self.config.known_pose_sigma_rad
        reach_m = node_of(self.grids[b]).diameter_m * sigma_rad
        covariance = np.diag([sigma_m**2 + reach_m**2, sigma_m**2 + reach_m**2, sigma_rad**2])
        return Prior(se2.between(np.asarray(T_team_map[a]), np.asarray(T_team_map[b])), covariance)

    def _may_touch(self, a: str, b: str, prior: Prior) -> bool:
        """Whether two maps can overlap at all, given their circles."""
        one, two = node_of(self.grids[a]), node_of(self.grids[b])
        apart = float(np.hypot(*(one.centre_m - se2.apply(prior.T_a_b, two.centre_m))))
        slack = 3.0 * float(np.sqrt(prior.covariance[0, 0]))
        return apart <= 0.5 * (one.diameter_m + two.diameter_m) + slack


def _first(cluster: TeamMap) -> str:
    return next(iter(cluster.T_team_map))


def _of_clusters(rejection: Rejection, one: TeamMap, other: TeamMap) -> Rejection:
    """Return the rejection of two clusters' fused maps, saying that it is about these."""
    counts = len(one.T_team_map), len(other.T_team_map)
    where = f"merged maps of {counts[0]} and {counts[1]} do not fit: " if max(counts) > 1 else ""
    return replace(rejection, reason=where + rejection.reason)


def _moved(found: Alignment, T_x_a: se2.Transform) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_x_b``."""
    J = np.eye(3)
    J[:2, :2] = se2.matrix(T_x_a)[:2, :2]
    return replace(found, T_a_b=se2.compose(T_x_a, found.T_a_b), covariance=J @ found.covariance @ J.T)


def _seen_from(found: Alignment, T_b_x: se2.Transform) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_a_x``; the shift's lever couples position to heading."""
    lever = se2.matrix(found.T_a_b)[:2, :2] @ T_b_x[:2]
    J = np.array([[1.0, 0.0, -lever[1]], [0.0, 1.0, lever[0]], [0.0, 0.0, 1.0]])
    return replace(found, T_a_b=se2.compose(found.T_a_b, T_b_x), covariance=J @ found.covariance @ J.T)


def _turned(found: Alignment) -> Alignment:
    """Return an alignment ``T_a_b`` as ``T_b_a``."""
    covariance = inverse_covariance(found.T_a_b, found.covariance)
    return replace(found, T_a_b=se2.inverse(found.T_a_b), covariance=covariance)
