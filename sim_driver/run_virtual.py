"""A mission in virtual time: all robots in this process, the same bytes for the same seed."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from agent import LinkSource, Runner, VirtualRobot, run_virtual
from comms import LinkConditions, MemoryNetwork
from comms.memory_transport import Conditions
from sim_driver.mission import Mission
from sim_driver.recorded import RecordedBody
from sim_driver.seeds import seed_for
from sim_driver.shaping import CUT_BELOW
from sim_driver.simulated import DirectPort
from sim_driver.simulation import Simulation, is_simulated
from sim_driver.team import make_agent, make_body, radio_of, read_trace, told_links, watchers_of


class VirtualWorld:
    """Network and simulated world, moved on together."""

    def __init__(self, network: MemoryNetwork, simulation: Simulation | None) -> None:
        """Take both; a mission of recorded robots has no world."""
        self._network, self._simulation = network, simulation

    def advance(self, now_ns: int) -> None:
        """Move virtual time on."""
        if self._simulation is not None:
            self._simulation.advance(now_ns)
        self._network.advance(now_ns)


def _conditions(radios: Mapping[str, LinkSource | None]) -> Conditions:
    """Return how every link is, by what the sender's radio says of it."""

    def conditions(sender: str, receiver: str, now_ns: int) -> LinkConditions:
        radio = radios.get(sender)
        quality = 1.0 if radio is None else radio.qualities(now_ns).get(receiver, 1.0)
        return LinkConditions.of_quality(quality if quality >= CUT_BELOW else 0.0)

    return conditions


def _one_thread_a_mapper(mission: Mission) -> Mission:
    """Return the mission for robots that take their turns side by side: enough of them keep all cores busy."""
    settings = mission.settings
    if settings.rbpf.threads or len(mission.robots) < len(os.sched_getaffinity(0)):
        return mission
    return replace(mission, settings=replace(settings, rbpf=replace(settings.rbpf, threads=1)))


def run_in_virtual_time(mission: Mission, out: Path, progress: Any) -> dict[str, Any]:
    """Run the mission and return what the metrics need beside the robots' own files."""
    simulation = Simulation(mission) if mission.world is not None and mission.replay is None else None
    trace = read_trace(mission)
    radios: dict[str, LinkSource | None] = {}
    network = MemoryNetwork(seed_for(mission, "network"), _conditions(radios))
    robots, durations_s = [], [0.0]
    settled = _one_thread_a_mapper(mission)
    for robot in mission.robots:
        port = DirectPort(simulation, robot.id) if simulation and is_simulated(mission, robot) else None
        body = make_body(mission, robot, port)
        if isinstance(body, RecordedBody):
            durations_s.append(body.duration_ns / 1e9)
        radio = radios[robot.id] = radio_of(mission, robot, trace, port)
        agent = make_agent(settled, robot, boot_id=seed_for(mission, f"boot/{robot.id}"))
        transport = network.attach(robot.id)
        folder = out / robot.id
        watchers = watchers_of(mission, robot, folder)
        robots.append(VirtualRobot(Runner(agent, body, transport, folder, told_links(mission, radio), watchers)))
    limit_s = mission.mission.duration_s
    total_s = limit_s or (max(durations_s) + mission.mission.linger_s if simulation is None else None)
    mission_ns = run_virtual(
        robots,
        VirtualWorld(network, simulation),
        step_ns=round(mission.settings.agent.tick_s * 1e9),
        duration_ns=None if limit_s is None else round(limit_s * 1e9),
        linger_ns=round(mission.mission.linger_s * 1e9),
        progress=lambda now_ns: progress(now_ns / 1e9, total_s, ""),
        threads=mission.settings.rbpf.threads,
    )
    if simulation is not None:
        simulation.write_truth(out)
    return {"mission_s": mission_ns / 1e9, "shell": "virtual"}
