"""The whole assessment of a run: of each robot, each pair and the mission, and what could not be judged and why."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mrslam.sim_driver.evaluate.in_saved_maps import in_saved_maps
from mrslam.sim_driver.evaluate.judges import References, pair_judge
from mrslam.sim_driver.evaluate.mission_row import mission_row
from mrslam.sim_driver.evaluate.network import link_rows
from mrslam.sim_driver.evaluate.pair_rows import pair_row
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.evaluate.robot_rows import robot_rows
from mrslam.sim_driver.evaluate.sides import pairs_of
from mrslam.spatial import InputError


def assess(folder: Path, references: References | None = None) -> dict[str, Any]:
    """Return the assessment of the run in ``folder``, as plain JSON values."""
    return assess_run(RunResults.read(folder), references or References())


def assess_run(run: RunResults, references: References) -> dict[str, Any]:
    """Return the assessment of a run.

    ``robots``, ``pairs``, ``links``, ``saved_maps``: a row each; ``mission``: sums over them; ``not_judged``: what was
    not and why; ``damaged``: files that could not be used, a line each. Raises ``InputError`` for references that do
    not fit the run.
    """
    _check_names(run, references)
    not_judged = [f"{robot}: was lost in the run" for robot in run.robots_lost]
    judge = pair_judge(run, references)
    robots = robot_rows(judge, references, not_judged)
    pairs = [pair_row(run, judge, a, b, not_judged) for a, b in pairs_of(run.beliefs)]
    return {
        "name": run.metrics["name"],
        "mission": mission_row(run, judge, robots, pairs),
        "robots": robots,
        "pairs": pairs,
        "links": link_rows(run),
        "saved_maps": in_saved_maps(run.events),
        "not_judged": not_judged,
        "damaged": run.damage,
    }


def _check_names(run: RunResults, references: References) -> None:
    """Refuse reference trajectories of robots that the run has not, or whose true ones it has."""
    robots = [robot.id for robot in run.mission.robots]
    all_simulated = {robot.id for robot in run.mission.robots if robot.mode != "central"} <= run.truth.keys()
    for name in references.trajectories:
        if name and name not in robots:
            raise InputError(f"reference of {name}: no such robot in this run; its robots are {', '.join(robots)}")
        if name in run.truth or (not name and all_simulated):
            raise InputError("reference: the run was simulated and knows its true trajectories; leave it out")
