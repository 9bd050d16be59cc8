"""A mission in virtual time: all robots in this process, the same bytes for the same seed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from agent import Runner, VirtualRobot, run_virtual
from comms import MemoryNetwork
from sim_driver.mission import Mission
from sim_driver.seeds import seed_for
from sim_driver.team import make_agent, read_trace, recorded_body
from sim_driver.traces import TracedLinks


def run_in_virtual_time(mission: Mission, out: Path, progress: Any) -> dict[str, Any]:
    """Run the mission and return what the metrics need beside the robots' own files."""
    trace = read_trace(mission)
    ids = [robot.id for robot in mission.robots]
    network = MemoryNetwork(seed=seed_for(mission, "network"))
    robots = []
    for robot in mission.robots:
        agent = make_agent(mission, robot, boot_id=seed_for(mission, f"boot/{robot.id}"))
        links = None if trace is None else TracedLinks(trace, robot.id, [other for other in ids if other != robot.id])
        robots.append(
            VirtualRobot(Runner(agent, recorded_body(mission, robot), network.attach(robot.id), out / robot.id, links))
        )
    duration_s = mission.mission.duration_s
    total_s = duration_s
    mission_ns = run_virtual(
        robots,
        network,
        step_ns=round(mission.settings.agent.tick_s * 1e9),
        duration_ns=None if duration_s is None else round(duration_s * 1e9),
        linger_ns=round(mission.mission.linger_s * 1e9),
        progress=lambda now_ns: progress(now_ns / 1e9, total_s, ""),
    )
    return {"mission_s": mission_ns / 1e9, "shell": "virtual"}
