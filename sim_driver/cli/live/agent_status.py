"""The line of status of a robot's agent: what it has seen, who is part of it, and where it is in saved maps."""

from __future__ import annotations

import math
import re

from mrslam.agent import Agent
from mrslam.agent.saved_maps import Whereabouts
from mrslam.sim_driver.run.known_area import KnownArea


def status_of(agent: Agent, known: KnownArea, more: str) -> str:
    """Return the line: scans, area and whose maps it is of, teammates, saved maps; ``more`` : where scans come from."""
    merged = ""
    if agent.mode == "mapper":
        merged = ", merges nothing itself"
    elif not known.placed:
        merged = ", merged nothing yet"
    here = f"{len(agent.node.peers)} teammates here{merged}"
    return f"{agent.scans} scans, {known.words}; {here}{_places(agent)}; {more}"


def _places(agent: Agent) -> str:
    """Return where the robot is in the saved map whose frame was chosen, and why it is in none of the others yet."""
    chosen, pose = agent.frame.saved_map, agent.T_frame_base
    places = []
    if chosen and pose is not None:
        x_m, y_m, theta_rad = (float(value) for value in pose)
        places.append(f", at {x_m:.2f}, {y_m:.2f} m, {math.degrees(theta_rad):.0f} deg in {chosen}")
    waits = [at for at in agent.whereabouts() if at.state != "localised" and (at.map_id != chosen or pose is None)]
    if chosen and pose is None and chosen not in agent.team.saved:
        waits.insert(0, Whereabouts(chosen, "not yet", "the robot has no such map"))
    return "".join(places + [f", not localised in {at.map_id} yet ({_short(at.reason)})" for at in waits])


def _short(reason: str) -> str:
    """Return the first part of a reason: without what comes after a semicolon or stands in parentheses."""
    return re.split(r"; | \(", reason)[0]
