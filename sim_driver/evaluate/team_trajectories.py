"""Errors of the one map that a robot makes of its team: of all robots' trajectories in it, bent as they are."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.judges import References
from mrslam.sim_driver.evaluate.relations import Relations, cross_errors
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.trajectories import Trajectory, absolute_errors, matched
from mrslam.spatial import se2

Row = dict[str, Any]


def team_row(run: RunResults, references: References, relations: Relations | None, robot_id: str) -> Row | None:
    """Return the errors of the other robots' and its own trajectories in a robot's team frame; None where it is alone.

    ``ate_rmse_m``, ``ate_mean_deg`` : of all of them after one rigid fit; ``mean_m``, ``mean_deg`` over ``count``
    relations between two robots. Each is left out where nothing judges it.
    """
    ways = run.team_trajectories(robot_id)
    if len(ways) < 2:
        return None
    row: Row = {"robots": sorted(ways)}
    row |= _absolute({one: (way, run.laser_truth(one) or references.trajectory(one)) for one, way in ways.items()})
    logs = {robot.id: robot.log for robot in run.mission.robots}
    if relations is not None:
        found = [
            cross_errors(relations, ways[a], ways[b], se2.IDENTITY)
            for a, b in combinations(sorted(ways), 2)
            if logs[a] is not None and logs[a] == logs[b]
        ]
        off = np.concatenate([np.empty((0, 2)), *found])
        if len(off):
            mean_m, mean_deg = off.mean(axis=0)
            row |= {"mean_m": round(float(mean_m), 4), "mean_deg": round(float(mean_deg), 4), "count": len(off)}
    return row


def _absolute(ways: Mapping[str, tuple[Trajectory, Trajectory | None]]) -> Row:
    """Return the absolute errors of all trajectories that have a reference, which must be of one frame, together."""
    pairs = [matched(way, truth)[1:] for way, truth in ways.values() if truth is not None]
    pairs = [pair for pair in pairs if len(pair[0])]
    if len(pairs) < 2:
        return {}
    ours, theirs = (np.concatenate(side) for side in zip(*pairs, strict=True))
    off_m, off_deg = absolute_errors(ours, theirs)
    return {
        "ate_rmse_m": round(float(np.sqrt(np.mean(off_m**2))), 4),
        "ate_mean_deg": round(float(off_deg.mean()), 4),
    }
