"""``metrics.json`` of a run, put together from what each robot left in its folder."""

from __future__ import annotations

import json
import logging
from collections.abc import Callable
from functools import cache
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.evaluate.in_saved_maps import in_saved_maps
from mrslam.sim_driver.evaluate.judges import (
    Judgement,
    References,
    by_place,
    by_relations,
    judged_row,
    relations_of,
    with_alignment,
)
from mrslam.sim_driver.evaluate.relations import Relations
from mrslam.sim_driver.evaluate.results import RunResults, link_totals
from mrslam.sim_driver.evaluate.sides import givers_of, pairs_of, placed_together, sides_of, speaker_of
from mrslam.sim_driver.evaluate.team import team_figures
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import METRICS_FILE
from mrslam.spatial.files.atomic import write_text

NEVER_MET = "never exchanged maps"
"""Reason of a pair that no robot knows anything of."""
log = logging.getLogger(__name__)


def write_metrics(mission: Mission, folder: Path, *, wall_s: float, mission_s: float, **more: Any) -> dict[str, Any]:
    """Write ``metrics.json`` into the run's folder and return it."""
    run = RunResults.of(mission, folder)
    relations = cache(lambda: relations_of(run, References()))  # read once, where a pair is judged by them
    pairs = [_pair(run, a, b, relations) for a, b in pairs_of(run.beliefs)]
    team = team_figures(run, pairs)
    for line in run.damage:
        log.warning("%s", line)
    metrics = {
        "name": mission.mission.name,
        "seed": mission.mission.seed,
        "wall_s": round(wall_s, 3),
        "mission_s": round(mission_s, 3),
        "pairs": pairs,
        "links": [link_totals(run.robots, a, b) for a, b in combinations(sorted(run.robots), 2)],
        "robots": [_robot(run, robot_id) for robot_id in run.robots],
        "robots_lost": run.robots_lost,
        **({} if team is None else {"team": team}),
        **({"saved_maps": in_saved_maps(run.events)} if mission.maps else {}),
        **more,
    }
    write_text(folder / METRICS_FILE, json.dumps(metrics, indent=1, allow_nan=False) + "\n")
    return metrics


def _robot(run: RunResults, robot_id: str) -> dict[str, Any]:
    """Return a robot's own row: what it left, but for what stands in the rows of pairs and links."""
    row = {key: value for key, value in run.robots[robot_id].items() if key not in ("pairs", "links")}
    usage = run.usage(robot_id)
    return row if usage is None else {**row, "usage": usage}


def _pair(run: RunResults, a: str, b: str, relations: Callable[[], Relations | None]) -> dict[str, Any]:
    """Return what is believed of a pair: by the first of the two that merged, or by a third where neither has."""
    views = {
        robot_id: row
        for robot_id, robot in run.beliefs.items()
        for row in robot["pairs"]
        if (row["a"], row["b"]) == (a, b)
    }
    unknown = {"a": a, "b": b, "status": "rejected", "T_a_b": None, "confidence": None, "reason": NEVER_MET}
    speaker = speaker_of(views, a, b)
    row = {**(unknown if speaker is None else views[speaker]), **sides_of(views, a, b, givers_of(run.beliefs))}
    row["placed_together_by"] = placed_together(run.beliefs, a, b)
    row["status"] = "accepted" if row["status"] == "accepted" else "rejected"
    return {**row, **judged_row(_judged(run, a, b, row["T_a_b"], relations))}


def _judged(
    run: RunResults, a: str, b: str, T_a_b: list[float] | None, relations: Callable[[], Relations | None]
) -> Judgement | str:
    """Return how far off the pair's transform is, or why that is not known."""
    if T_a_b is None:
        return "not merged"
    found = by_place([(run.T_world_map, "simulated truth")], a, b, np.array(T_a_b))
    found = with_alignment(run, found, a, b, np.array(T_a_b)) or by_relations(run, relations(), a, b, np.array(T_a_b))
    return found or ("no truth" if relations() is None else "no relation links the two robots")
