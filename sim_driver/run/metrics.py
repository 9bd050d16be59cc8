"""``metrics.json`` of a run, put together from what each robot left in its folder."""

from __future__ import annotations

import json
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.events import first_merge_s
from mrslam.sim_driver.evaluate.relations import cross_errors, read_relations
from mrslam.sim_driver.evaluate.sides import givers_of, pairs_of, sides_of, speaker_of
from mrslam.sim_driver.evaluate.truth import pair_error, team_figures, true_starts, true_trajectories
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import METRICS_FILE, TRAJECTORY_FILE
from mrslam.sim_driver.missions.run_folder import read_events, read_robots
from mrslam.sim_driver.missions.usage import read_usage
from mrslam.spatial.files.atomic import write_text
from mrslam.spatial.files.tum import read_tum
from mrslam.spatial.se2 import Transform

NEVER_MET = "never exchanged maps"


def write_metrics(mission: Mission, folder: Path, *, wall_s: float, mission_s: float, **more: Any) -> dict[str, Any]:
    """Write ``metrics.json`` into the run's folder and return it."""
    robots = read_robots(folder, (robot.id for robot in mission.robots))
    for robot_id, robot in robots.items():
        if (usage := read_usage(folder / robot_id)) is not None:
            robot["usage"] = usage
    missing = [robot.id for robot in mission.robots if robot.id not in robots]
    starts = true_starts(true_trajectories(mission, folder), folder)
    pairs = [_pair(mission, folder, robots, starts, a, b) for a, b in pairs_of(robots)]
    team = team_figures(mission, folder, robots, starts, pairs)
    if team is not None:
        team["first_merge_s"] = first_merge_s(read_events(folder / robot) for robot in robots)
    metrics = {
        "name": mission.mission.name,
        "seed": mission.mission.seed,
        "wall_s": round(wall_s, 3),
        "mission_s": round(mission_s, 3),
        "pairs": pairs,
        "links": [_link(robots, a, b) for a, b in combinations(sorted(robots), 2)],
        "robots": [
            {key: value for key, value in robot.items() if key not in ("pairs", "links")} for robot in robots.values()
        ],
        "robots_lost": missing,
        **({} if team is None else {"team": team}),
        **more,
    }
    write_text(folder / METRICS_FILE, json.dumps(metrics, indent=1, allow_nan=False) + "\n")
    return metrics


def _pair(
    mission: Mission, folder: Path, robots: dict[str, Any], starts: dict[str, Transform], a: str, b: str
) -> dict[str, Any]:
    """Return what is believed of a pair: by the first of the two that merged, or by a third where neither has."""
    views = {
        robot_id: row for robot_id, robot in robots.items() for row in robot["pairs"] if (row["a"], row["b"]) == (a, b)
    }
    unknown = {"a": a, "b": b, "status": "rejected", "T_a_b": None, "confidence": None, "reason": NEVER_MET}
    speaker = speaker_of(views, a, b)
    row = {**(unknown if speaker is None else views[speaker]), **sides_of(views, a, b, givers_of(robots))}
    row["status"] = "accepted" if row["status"] == "accepted" else "rejected"
    row["error_m"], row["error_deg"], row["judged_by"] = _error(mission, folder, starts, a, b, row["T_a_b"])
    return row


def _error(
    mission: Mission, folder: Path, starts: dict[str, Transform], a: str, b: str, T_a_b: list[float] | None
) -> tuple[float | None, float | None, str]:
    """Return the pair's mean error (m, deg) and what it was judged by."""
    if T_a_b is None:
        return None, None, "not merged"
    if a in starts and b in starts:
        off_m, off_deg = pair_error(np.array(T_a_b), starts[a], starts[b])
        return round(off_m, 4), round(off_deg, 4), "simulated truth"
    logs = {robot.id: robot.log for robot in mission.robots}
    if mission.truth.relations is None or logs[a] is None or logs[a] != logs[b]:
        return None, None, "no truth"
    relations = read_relations(mission.find(mission.truth.relations))
    poses = [read_tum(folder / robot / TRAJECTORY_FILE) for robot in (a, b)]
    errors = cross_errors(relations, poses[0], poses[1], np.array(T_a_b))
    if len(errors) == 0:
        return None, None, "no relation links the two robots"
    mean_m, mean_deg = errors.mean(axis=0)
    return round(float(mean_m), 4), round(float(mean_deg), 4), f"{len(errors)} of {len(relations[0])} relations"


def _link(robots: dict[str, Any], a: str, b: str) -> dict[str, Any]:
    """Return what went over a pair's link, both ways."""
    sides = [link for one, other in ((a, b), (b, a)) for link in robots[one]["links"] if link["peer"] == other]
    return {
        "a": a,
        "b": b,
        "exchanges": max((side["exchanges"] for side in sides), default=0),
        **{key: sum(side[key] for side in sides) for key in ("bytes_sent", "bytes_full_lz4", "bytes_full_raw")},
    }
