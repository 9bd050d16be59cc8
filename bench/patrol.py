"""Missions whose robots drive in rounds between a few places for ever: after the first nothing is left to discover."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.simulation.simulation import make_world

PLACES = 6


def patrol(tables: dict[str, Any], name: str) -> Mission:
    """Return the mission of the tables, each robot with a start and rounds of its own in the world, by its seed."""
    file = Path(f"{name}.toml")
    world = make_world(make_mission(tables, file))
    rng = np.random.default_rng(tables["mission"]["seed"])
    for robot in tables["robots"]:
        start = world.free_start(rng, 0.4, np.empty((0, 2)))
        rounds = [world.free_start(rng, 0.4, np.empty((0, 2)))[:2].tolist() for _ in range(PLACES)]
        robot.update(driver="waypoints", start=start.tolist(), waypoints=rounds, patrol=True)
    return make_mission(tables, file)
