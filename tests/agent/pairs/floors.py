"""A team whose maps are plain floors, so that only what alignments say of them counts."""

from __future__ import annotations

from typing import Any

import numpy as np

from mrslam.agent.config import AgentConfig, Settings
from mrslam.agent.effects import AlignJob, Event
from mrslam.agent.known_map import KnownMap
from mrslam.agent.pairs.belief import PairBelief
from mrslam.agent.pairs.hypotheses import Hypothesis
from mrslam.agent.team import Team
from mrslam.alignment import Alignment, Evidence, Rejection, WallEvidence
from mrslam.spatial import LocalMap, OccupancyGrid, TiledMap
from mrslam.spatial.se2 import Transform

S = 1_000_000_000


def found(
    x: float = 1.0,
    confidence: float = 0.9,
    theta: float = 0.0,
    wall_m: float = 0.0,
    overlap_m2: float = 0.0,
    against_m: float = 0.0,
) -> Alignment:
    T_a_b = np.array([x, 0.0, theta])
    return Alignment(T_a_b, confidence, walls(wall_m, against_m, overlap_m2), np.eye(3) * 1e-4, "auto")


def walls(matched_m: float, contradicted_m: float, overlap_m2: float = 0.0) -> Evidence:
    side = WallEvidence(matched_m=matched_m, contradicted_m=contradicted_m)
    return Evidence(a=side, b=side, overlap_m2=overlap_m2, overlap=0.5)


def weak(wall_m: float, overlap_m2: float = 0.0) -> Alignment:
    return Alignment(np.array([1.0, 0.0, 0.0]), 0.58, walls(wall_m, 0.0, overlap_m2), np.eye(3) * 1e-4, "auto")


def say(belief: PairBelief, T_a_b: Transform, llr: float, by: str = "r1") -> Hypothesis:
    """Let a robot say how much speaks for a place of a pair, nats; return the place."""
    place = belief.places.add(T_a_b, "maps", 0)
    assert place is not None
    place.told = {by: llr}
    return place


def floor(cells: int, revision: int, epoch: int) -> KnownMap:
    grid = OccupancyGrid(np.zeros((cells, cells), dtype=np.int8), 0.05)
    return KnownMap((epoch, revision), LocalMap(TiledMap.from_grid(grid, revision)))


class Floors(Team):
    """The team of r2; every robot's map is a free square."""

    def __init__(self, *robots: str, settings: Settings | None = None) -> None:
        super().__init__("r2", settings or Settings(agent=AgentConfig(align_interval_s=10.0, align_growth=0.1)))
        self.searching: set[str] = set()
        for robot in robots:
            self.grow(robot, 64)

    def grow(self, robot: str, cells: int, revision: int = 1, epoch: int = 1) -> None:
        """Let a robot publish a square of this number of cells a side."""
        self.take_map(robot, floor(cells, revision, epoch))

    def save(self, map_id: str, cells: int = 200) -> None:
        """Give the team a saved map, a square of this number of cells a side."""
        self.take_saved_map(map_id, floor(cells, 1, 1))

    def job(self, t_s: float) -> AlignJob:
        """Return the alignment that is due."""
        job = self.next_job(round(t_s * S), self.searching)
        assert isinstance(job, AlignJob)
        return job

    def job_of(self, a: str, b: str, attempt: int = 0, sighted: Transform | None = None) -> AlignJob:
        """Return the alignment of a pair, due or not."""
        maps = self.maps[a], self.maps[b]
        versions, areas = (maps[0].version, maps[1].version), (maps[0].area_m2, maps[1].area_m2)
        return AlignJob(a, b, maps[0].grid, maps[1].grid, None, versions, areas, attempt, sighted=sighted)

    def end(self, job: AlignJob, outcome: Alignment | Rejection, t_s: float) -> dict[str, Any]:
        """Let an alignment end; return the event that reports it."""
        event = self.on_aligned(job, outcome, round(t_s * S))[0]
        assert isinstance(event, Event) and event.kind == "alignment"
        return event.fields

    def align(self, outcome: Alignment | Rejection, t_s: float) -> dict[str, Any]:
        """Let the alignment that is due end at once."""
        return self.end(self.job(t_s), outcome, t_s)

    def due(self, t_s: float) -> tuple[str, str] | None:
        """Return the pair that is due, if one is."""
        job = self.next_job(round(t_s * S), self.searching)
        return (job.a, job.b) if isinstance(job, AlignJob) else None


def merged() -> Floors:
    """Return a team in which r1 and r2 were merged at 10 s."""
    team = Floors("r1", "r2")
    for t_s in (0, 10):
        team.align(found(), t_s)
    assert team.beliefs["r1", "r2"].status == "accepted" and "r1" in team.layout.T_team_map
    return team
