"""Finished runs, and such as are changed on purpose."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run import run_mission


def played(tables: dict[str, Any], out: Path) -> Path:
    """Run a mission without a word and return its folder."""
    run_mission(make_mission(tables, Path("small.toml")), out, lambda now_s, total_s, text: None, lambda text: None)
    return out


def with_wrong_merge(run: Path, copy: Path, robot_id: str, axis: int, by_m: float) -> Path:
    """Copy a run in which the robot's first pair came out wrong by so much along x (0) or y (1)."""
    shutil.copytree(run, copy)
    path = copy / robot_id / "robot.json"
    robot = json.loads(path.read_text())
    robot["pairs"][0]["T_a_b"][axis] += by_m
    path.write_text(json.dumps(robot))
    return copy
