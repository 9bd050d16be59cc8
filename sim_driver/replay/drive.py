"""How long a replay tells what driving anew would have told.

A robot that explores drives by the team's map as soon as another is placed in it. Until then it drives by its own scans
alone, so that the recorded drive is the one it would take under any other thresholds. From the first difference in what
a robot knows of its team, it might have driven elsewhere: the replay goes on with the drive as it was.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_folder import read_events
from mrslam.sim_driver.simulation.simulation import is_simulated

TEAM_KNOWLEDGE = ("merged", "unmerged", "map_updated", "alignment")


def drive_holds_until_s(mission: Mission, recorded: Path, replayed: Path) -> float | None:
    """Return the mission time up to which the recorded drive is the one that the replay's settings lead to.

    None: to the end. Robots with a log or without a goal of their own go the same way whatever they know.
    """
    drivers = [robot.id for robot in mission.robots if is_simulated(mission, robot) and robot.driver != "idle"]
    if not drivers:
        return None
    differ_s: list[float] = []
    merged_s: list[float] = []
    for robot_id in drivers:
        then, now = (_team_events(folder / robot_id) for folder in (recorded, replayed))
        merged_s += [event["t"] for event in (*then, *now) if event["event"] == "merged"]
        differ_s += _first_difference_s(then, now)
    if not differ_s or not merged_s:
        return None
    return max(min(differ_s), min(merged_s))


def _team_events(folder: Path) -> list[dict[str, Any]]:
    """Return the events by which a robot's view of its team changes."""
    return [
        event
        for event in read_events(folder).events
        if event["event"] in TEAM_KNOWLEDGE and (event["event"] != "alignment" or event["T_a_b"] is not None)
    ]


def _first_difference_s(one: list[dict[str, Any]], other: list[dict[str, Any]]) -> list[float]:
    for a, b in zip(one, other, strict=False):
        if a != b:
            return [min(a["t"], b["t"])]
    longer = max(one, other, key=len)
    rest = longer[min(len(one), len(other)) :]
    return [rest[0]["t"]] if rest else []
