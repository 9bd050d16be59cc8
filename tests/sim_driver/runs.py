"""Finished runs, changed on purpose."""

from __future__ import annotations

import json
import shutil
from pathlib import Path


def with_wrong_merge(run: Path, copy: Path, robot_id: str, axis: int, by_m: float) -> Path:
    """Copy a run in which the robot's first pair came out wrong by so much along x (0) or y (1)."""
    shutil.copytree(run, copy)
    path = copy / robot_id / "robot.json"
    robot = json.loads(path.read_text())
    robot["pairs"][0]["T_a_b"][axis] += by_m
    path.write_text(json.dumps(robot))
    return copy
