"""Aligning pairs of many maps in parallel, and keeping the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, field

from mrslam.alignment import Alignment, AlignmentConfig, Prior, Rejection, align
from mrslam.merge.config import MergeConfig
from mrslam.merge.graph.carried import turned
from mrslam.merge.graph.edges import Pair, pair_of
from mrslam.merge.graph.tree import components
from mrslam.merge.grids.agreement import Walls
from mrslam.merge.grids.tiled_grid import TiledGrid
from mrslam.merge.joint.align_bent import Scanned, align_bent
from mrslam.merge.joint.local_match import LocalMatcher
from mrslam.merge.joint.trail import Trail
from mrslam.merge.team import TeamMap, TeamMapper
from mrslam.spatial import OccupancyGrid

Progress = Callable[[int, int], None]
"""(alignments or maps done, in all)."""
Job = tuple[str, str, Prior | None]
"""Two maps by name and the prior of their transform."""


@dataclass
class PairAligner:
    """Aligns pairs of maps by name, and keeps the result of each pair."""

    grids: Mapping[str, OccupancyGrid]
    method: str
    pool: Executor
    config: MergeConfig
    progress: Progress | None = None
    trails: Mapping[str, Trail] = field(default_factory=dict)
    """By id, where it is known: the way that made the map. Maps that fit only when bent need both ways."""
    edges: dict[Pair, Alignment] = field(default_factory=dict)
    """Accepted ``T_a_b``, a < b."""
    rejections: dict[Pair, Rejection] = field(default_factory=dict)
    """Why a pair does not fit; of two clusters that do not, under the pair of their first members."""
    tried: int = 0
    """Alignments computed."""
    vetted: set[Pair] = field(default_factory=set)
    """Bridges (alignments without which a cluster falls apart) that were checked already."""

    _walls: dict[str, Walls] = field(default_factory=dict)
    _matcher: LocalMatcher = field(default_factory=LocalMatcher)

    def walls(self, name: str) -> Walls:
        """Return a map prepared for comparing; made once."""
        if name not in self._walls:
            self._walls[name] = Walls(TiledGrid.of(self.grids[name]))
        return self._walls[name]

    def report(self, done: int, whole: int) -> None:
        """Report progress, if anyone asked for it."""
        if self.progress is not None:
            self.progress(done, whole)

    def align_pairs(self, jobs: Sequence[Job], report: bool = False) -> list[Pair]:
        """Align pairs in parallel; return those accepted, in the order of the jobs."""
        found = self.pool.map(self._align, jobs)
        accepted = []
        for done, ((a, b, _), result) in enumerate(zip(jobs, found, strict=True), start=1):
            self.tried += 1
            if self.keep(a, b, self._bent(a, b, result)):
                accepted.append(pair_of(a, b))
            if report:
                self.report(done, len(jobs))
        return accepted

    def _align(self, job: Job) -> Alignment | Rejection:
        a, b, prior = job
        scanned = {a, b} <= self.trails.keys()  # bent by their scans, not by their walls alone
        config = AlignmentConfig(strain=0.0) if scanned else None
        grids = (self.grids[a], self.grids[b])
        return align(*grids, method=self.method, prior=prior, config=config, by_parts=scanned)

    def _bent(self, a: str, b: str, result: Alignment | Rejection) -> Alignment | Rejection:
        """Return an alignment in place of a rejection where the maps fit once they are bent."""
        if not isinstance(result, Rejection) or not {a, b} <= self.trails.keys():
            return result
        one, two = (Scanned(self.grids[name], self.trails[name]) for name in (a, b))
        return align_bent(one, two, result, self.method, AlignmentConfig(strain=0.0), self._matcher)

    def align_grids(self, one: OccupancyGrid, others: Sequence[OccupancyGrid]) -> list[Alignment | Rejection]:
        """Align one map with each of the others in parallel, keeping no result."""
        self.tried += len(others)
        return list(self.pool.map(lambda other: align(one, other, method=self.method, by_parts=False), others))

    def keep(self, a: str, b: str, result: Alignment | Rejection) -> bool:
        """Keep the result of a pair; return whether it was accepted."""
        pair = pair_of(a, b)
        if isinstance(result, Rejection):
            self.rejections[pair] = result
            return False
        self.edges[pair] = result if (a, b) == pair else turned(result)
        self.rejections.pop(pair, None)
        return True

    def cluster(self, names: Sequence[str]) -> TeamMap:
        """Return the team map of the first of these maps and those others that are connected to it."""
        mapper = TeamMapper(names[0], self.config)
        for name in names:
            mapper.set_map(name, self.grids[name])
        return mapper.team_map(self.edges)

    def clusters(self, names: Iterable[str]) -> list[TeamMap]:
        """Return the team maps of these maps: one, or several where not all hold together."""
        inside, found = set(names), list[TeamMap]()
        for group in components(inside, [pair for pair in self.edges if inside.issuperset(pair)]):
            rest = set(group)
            while rest:
                found.append(self.cluster(sorted(rest)))
                rest -= found[-1].T_team_map.keys()
        return found


def first(cluster: TeamMap) -> str:
    """Return the first of a cluster's maps; its frame is the cluster's."""
    return next(iter(cluster.T_team_map))
