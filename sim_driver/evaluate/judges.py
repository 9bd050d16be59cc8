"""Sources that judge the transform between two maps: simulator, reference trajectories, relations, a true map."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.alignment import Alignment, align
from mrslam.sim_driver.evaluate.relations import Relations, cross_errors, read_relations
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.trajectories import Trajectory, fit
from mrslam.sim_driver.evaluate.truth import Judge, is_false_merge, overlap, pair_error, shared_middle
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.simulation.simulation import make_world
from mrslam.spatial import OccupancyGrid
from mrslam.spatial.se2 import Transform


@dataclass(frozen=True)
class Judgement:
    """How far off the transform between two maps is."""

    error_m: float
    error_deg: float
    judged_by: str
    alignment_m: float | None = None
    """The alignment's own error: with each map placed by its robot's whole trajectory, not by its first scan, in the
    middle of what the two maps share, not at a start pose."""
    alignment_deg: float | None = None

    @property
    def is_false(self) -> bool:
        """Whether this is a wrong merge, not only an inaccurate one: by the alignment's own error where that is known.

        A map whose first stretch is bent by a decimetre or a tenth of a degree puts its origin, or another robot's at
        the far end of a campus, off by as much as the width of a door, however well the two maps are aligned; and a
        tenth of a degree between two maps is half a metre at a start pose 300 m from where they meet.
        """
        if self.alignment_m is not None and self.alignment_deg is not None:
            return is_false_merge(self.alignment_m, self.alignment_deg)
        return is_false_merge(self.error_m, self.error_deg)


def judged_row(judged: Judgement | str | None) -> dict[str, Any]:
    """Return what is told of how far off a pair is, or why that is not known (a string, or nothing)."""
    known = judged if isinstance(judged, Judgement) else None
    names = ("error_m", "error_deg", "alignment_m", "alignment_deg")
    values = [None if known is None else getattr(known, name) for name in names]
    return {
        **{name: None if value is None else round(value, 4) for name, value in zip(names, values, strict=True)},
        "judged_by": judged if known is None else known.judged_by,
        "is_false": None if known is None else known.is_false,
    }


@dataclass(frozen=True)
class References:
    """What to judge by beside the simulator's truth, which a simulated run brings along."""

    relations: Path | None = None
    """Relations file; a mission may name one itself."""
    trajectories: Mapping[str, Trajectory] = field(default_factory=dict)
    """Reference trajectories in one frame, by robot; under "" one that holds for all."""
    true_map: OccupancyGrid | None = None

    def trajectory(self, robot_id: str) -> Trajectory | None:
        """Return the reference of one robot."""
        return self.trajectories.get(robot_id, self.trajectories.get(""))


@dataclass(frozen=True, eq=False)
class PairJudge:
    """Judges the pairs of a run, each by the best there is."""

    run: RunResults
    relations: Relations | None
    places: Sequence[tuple[Mapping[str, Transform], str]]
    """Where robots' maps lie, in one frame, and how that is known; the best first, the true map last."""

    @property
    def in_true_map(self) -> Mapping[str, Transform]:
        """Where robots' maps lie in the true map: each is aligned with it once for a run."""
        return self.places[-1][0]

    def judge(self, a: str, b: str, T_a_b: Transform) -> Judgement | str:
        """Return the error of ``T_a_b``, or why it is not known."""
        *known, in_true_map = self.places
        return (
            with_alignment(self.run, by_place(known, a, b, T_a_b), a, b, T_a_b)
            or by_relations(self.run, self.relations, a, b, T_a_b)
            or by_place([in_true_map], a, b, T_a_b)
            or "no truth, reference, relation or true map links the two"
        )

    def overlap(self, a: str, b: str) -> float | None:
        """Return the share of the smaller of two maps that the other shows too; None where their places are unknown."""
        for placed, _ in self.places:
            if a in placed and b in placed:
                map_a, map_b = self.run.map(a), self.run.map(b)
                return None if map_a is None or map_b is None else overlap(map_a, map_b, placed[a], placed[b])
        return None


def pair_judge(run: RunResults, references: References) -> PairJudge:
    """Return the judge of this run's pairs."""
    places = (
        (run.T_world_map, "simulated truth"),
        (_placed_by_reference(run, references), "reference trajectories"),
        (_placed_in_true_map(run, references), "alignment with the true map"),
    )
    return PairJudge(run, relations_of(run, references), places)


def by_place(
    places: Sequence[tuple[Mapping[str, Transform], str]], a: str, b: str, T_a_b: Transform
) -> Judgement | None:
    """Return the error by the first of the places that have both maps, None where none has."""
    for placed, words in places:
        if a in placed and b in placed:
            return Judgement(*pair_error(T_a_b, placed[a], placed[b]), words)
    return None


def relations_of(run: RunResults, references: References) -> Relations | None:
    """Return the relations to judge by: those given, or those the mission names if they are still there."""
    if references.relations is not None:
        return read_relations(references.relations)
    if run.mission.truth.relations is None:
        return None
    return run.tried(Path(run.mission.truth.relations), lambda path: _named(run.mission, path), None)


def _named(mission: Mission, path: Path) -> Relations | None:
    return read_relations(mission.find(str(path)))


def with_alignment(run: RunResults, found: Judgement | None, a: str, b: str, T_a_b: Transform) -> Judgement | None:
    """Return a judgement with the alignment's own error, where the simulator knows the whole ways of both robots."""
    if found is None or not {a, b} <= run.T_world_way.keys():
        return found
    maps, ways = (run.map(a), run.map(b)), (run.T_world_way[a], run.T_world_way[b])
    middle = None if maps[0] is None or maps[1] is None else shared_middle(maps[0], maps[1], *ways)
    off_m, off_deg = pair_error(T_a_b, *ways, middle)
    return replace(found, alignment_m=off_m, alignment_deg=off_deg)


def by_relations(run: RunResults, relations: Relations | None, a: str, b: str, T_a_b: Transform) -> Judgement | None:
    """Return the mean error over the relations between robots of one log, None where none links them."""
    logs = {robot.id: robot.log for robot in run.mission.robots}
    if relations is None or logs[a] is None or logs[a] != logs[b]:
        return None
    errors = cross_errors(relations, run.trajectory(a), run.trajectory(b), T_a_b)
    if len(errors) == 0:
        return None
    mean_m, mean_deg = errors.mean(axis=0)
    return Judgement(float(mean_m), float(mean_deg), f"{len(errors)} of {len(relations[0])} relations")


def _placed_by_reference(run: RunResults, references: References) -> dict[str, Transform]:
    placed = {}
    for robot_id in run.robots:
        reference = references.trajectory(robot_id)
        T_reference_map = None if reference is None else fit(run.trajectory(robot_id), reference)
        if T_reference_map is not None:
            placed[robot_id] = T_reference_map
    return placed


def _placed_in_true_map(run: RunResults, references: References) -> dict[str, Transform]:
    if references.true_map is None:
        return {}
    maps = {robot_id: run.map(robot_id) for robot_id in run.robots}
    found = {robot_id: align(references.true_map, grid) for robot_id, grid in maps.items() if grid is not None}
    return {robot_id: outcome.T_a_b for robot_id, outcome in found.items() if isinstance(outcome, Alignment)}


def map_judge(judge: PairJudge, references: References) -> tuple[Judge, Mapping[str, Transform]] | None:
    """Return the true map to hold maps against, and where each robot's map lies in it; None where there is none."""
    run = judge.run
    if run.mission.world is not None and run.T_world_map:
        world = make_world(run.mission)
        return Judge(world.grid, world.reachable), run.T_world_map
    if references.true_map is not None:
        grid = references.true_map
        return Judge(grid, np.ascontiguousarray(grid.is_free)), judge.in_true_map
    return None
