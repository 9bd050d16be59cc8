"""The figures of a simulated mission as a whole, for ``metrics.json``."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from typing import Any

from mrslam.sim_driver.evaluate.events import first_merge_s
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.truth import MUST_MERGE, Judge, overlap
from mrslam.sim_driver.simulation.simulation import make_world

Pair = dict[str, Any]
"""A row of ``pairs`` in ``metrics.json``."""


def team_figures(run: RunResults, pairs: Sequence[Pair]) -> dict[str, Any] | None:
    """Return coverage, precision and merge counts of a simulated mission; None of others, and without any team map."""
    worth = {} if run.mission.world is None else _team_maps(run)
    if not worth:
        return None
    accepted = [pair for pair in pairs if pair["status"] == "accepted"]
    return {
        "coverage": round(max(coverage for coverage, _ in worth.values()), 4),
        "occupied_precision": round(min(precision for _, precision in worth.values()), 4),
        "coverage_by_robot": {robot: round(coverage, 4) for robot, (coverage, _) in worth.items()},
        "false_merges": sum(bool(pair["is_false"]) for pair in accepted),
        "missed_merges": _missed(run, {(pair["a"], pair["b"]) for pair in accepted}),
        "one_sided_merges": sum(pair["both_at_s"] is None for pair in accepted),
        "first_merge_s": first_merge_s(run.events[robot] for robot in run.robots),
    }


def _team_maps(run: RunResults) -> dict[str, tuple[float, float]]:
    """Return coverage and precision of every robot's team map."""
    frames = run.team_frames(run.T_world_map)
    if not frames:
        return {}
    world = make_world(run.mission)
    judge = Judge(world.grid, world.reachable)
    worth = {}
    for robot_id, T_world_team in frames.items():
        team = run.map(robot_id, "team_map", keep=False)
        if team is not None:
            worth[robot_id] = judge.coverage(team, T_world_team), judge.occupied_precision(team, T_world_team)
    return worth


def _missed(run: RunResults, done: set[tuple[str, str]]) -> int:
    """Return how many pairs of maps were not merged though they overlap enough."""
    places = run.T_world_map
    maps = {robot_id: run.map(robot_id) for robot_id in sorted(places.keys() & run.robots.keys())}
    known = {robot_id: grid for robot_id, grid in maps.items() if grid is not None}
    return sum(
        overlap(known[a], known[b], places[a], places[b]) >= MUST_MERGE
        for a, b in combinations(known, 2)
        if (a, b) not in done
    )
