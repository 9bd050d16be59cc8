"""The assessment of each robot: its trajectory, relations, maps, and what its process took of the machine."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.judges import PairJudge, References, map_judge
from mrslam.sim_driver.evaluate.network import exchanges
from mrslam.sim_driver.evaluate.relations import Relations, own_errors
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.team_trajectories import team_row
from mrslam.sim_driver.evaluate.trajectories import errors
from mrslam.sim_driver.evaluate.truth import Judge
from mrslam.spatial.se2 import Transform

GHOST_M = 0.3
"""Wall cells this near to where a teammate drove, with no true wall there, are its ghost, metres: about the radius of
the simulated robots with a cell of the map to either side."""

Row = dict[str, Any]


def robot_rows(judge: PairJudge, references: References, not_judged: list[str]) -> dict[str, Row]:
    """Return a row for every robot that ended in good order; reasons for what is missing go to ``not_judged``."""
    run, relations = judge.run, judge.relations
    against = map_judge(judge, references)
    frames = {} if against is None else run.team_frames(against[1])
    rows = {}
    for robot_id, robot in run.robots.items():
        missing: list[str] = []
        rows[robot_id] = {
            "known_area_m2": robot["known_area_m2"],
            "exchanges": exchanges(run.events[robot_id]),
            "trajectory": _trajectory(run, references, robot_id, missing),
            "relations": None if relations is None else _relations(run, relations, robot_id, missing),
            "team": team_row(run, references, relations, robot_id),
            "map": _map(run, against, frames, robot_id, missing),
            "usage": run.usage(robot_id),
        }
        if rows[robot_id]["usage"] is None:
            missing.append("CPU and memory: robots of a virtual run share one process")
        not_judged += [f"{robot_id}, {reason}" for reason in missing]
    return rows


def _trajectory(run: RunResults, references: References, robot_id: str, missing: list[str]) -> Row | None:
    """Return ATE and RPE against the simulator's truth or the reference."""
    if run.robots[robot_id]["mode"] == "central":
        return None
    reference = run.laser_truth(robot_id) or references.trajectory(robot_id)
    found = None if reference is None else errors(run.trajectory(robot_id), reference)
    if found is None:
        why = "no true or reference trajectory" if reference is None else "no common stamps with the reference"
        missing.append(f"trajectory: {why}")
    return found


def _relations(run: RunResults, relations: Relations, robot_id: str, missing: list[str]) -> Row | None:
    """Return mean and standard deviation of the errors over the relations that lie within the trajectory."""
    trajectory = run.trajectory(robot_id)
    if not len(trajectory[0]):
        return None
    off, given = own_errors(relations, *trajectory), len(relations[0])
    if not len(off):
        missing.append(f"relations: none of {given} lies within its trajectory")
        return None
    mean, std = off.mean(axis=0), off.std(axis=0)
    return {
        "count": len(off),
        "given": given,
        "mean_m": round(float(mean[0]), 4),
        "std_m": round(float(std[0]), 4),
        "mean_deg": round(float(mean[1]), 4),
        "std_deg": round(float(std[1]), 4),
    }


def _map(
    run: RunResults,
    against: tuple[Judge, Mapping[str, Transform]] | None,
    frames: dict[str, Transform],
    robot_id: str,
    missing: list[str],
) -> Row | None:
    """Return the row of a robot's maps, held against the true map ``against`` with their places in it."""
    team = run.map(robot_id, "team_map")
    if against is None:
        missing.append("map: no true map")
    elif robot_id not in frames:
        missing.append("map: its place in the true map was not found")
    elif team is None:
        missing.append("map: its file is damaged")
    else:
        truth, places = against
        T_team, own = frames[robot_id], run.map(robot_id) if robot_id in places else None
        return {
            "coverage_own": None if own is None else round(truth.coverage(own, places[robot_id]), 4),
            "coverage_team": round(truth.coverage(team, T_team), 4),
            "occupied_precision": round(truth.occupied_precision(team, T_team), 4),
            "occupied_recall": rounded(truth.occupied_recall(team, T_team)),
            "free_agreement": rounded(truth.free_agreement(team, T_team)),
            "ghost_cells": _ghosts(run, truth, robot_id, T_team),
        }
    return None


def _ghosts(run: RunResults, truth: Judge, robot_id: str, T_team: Transform) -> int | None:
    """Return how many wall cells of the robot's team map teammates left; None where nobody's way is known."""
    team = run.map(robot_id, "team_map")
    ways = [poses[:, :2] for other, (_, poses) in run.truth.items() if other != robot_id]
    return None if team is None or not ways else truth.ghosts(team, T_team, np.concatenate(ways), GHOST_M)


def rounded(value: float | None) -> float | None:
    """Return a measure to four digits, None where there is none."""
    return None if value is None else round(value, 4)
