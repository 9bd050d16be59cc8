"""What runs in a robot's own process."""

from __future__ import annotations

import os
import signal
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event as StopEvent
from pathlib import Path

from agent import MissionClock, ProcessShell, Runner
from comms import ZenohTransport
from sim_driver.mission import Mission, RobotConfig
from sim_driver.shaping import ShapedTransport
from sim_driver.seeds import seed_for
from sim_driver.team import make_agent, read_trace, recorded_body
from sim_driver.traces import TracedLinks

STATUS_S = 0.5
"""How often a robot tells the parent how it fares, seconds."""


@dataclass(frozen=True)
class RobotTask:
    """Everything a robot's process is given."""

    mission: Mission
    robot: RobotConfig
    out: Path
    listen: str
    connect: list[str]


@dataclass(frozen=True)
class Ready:
    """Sent by a robot that has its log and its network."""

    duration_s: float


@dataclass(frozen=True)
class Go:
    """Sent to all robots: when mission time begins (``time.monotonic``)."""

    start_s: float


@dataclass(frozen=True)
class Status:
    """How a robot fares."""

    finished: bool = False
    merged: int = 0
    area_m2: float = 0.0


def run_robot(task: RobotTask, pipe: Connection, stop: StopEvent) -> None:
    """Map, meet and merge until told to stop, then write the robot's files."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the parent tells when to stop
    mission, robot = task.mission, task.robot
    body = recorded_body(mission, robot)
    agent = make_agent(mission, robot, boot_id=int.from_bytes(os.urandom(4), "little"))
    transport = ZenohTransport(
        robot.id, mission.mission.name, listen=[task.listen], connect=task.connect, multicast=False
    )
    pipe.send(Ready(body.duration_ns / 1e9))
    go = pipe.recv()
    clock = MissionClock(go.start_s, mission.mission.speed)
    links, network = None, transport
    trace = read_trace(mission)
    if trace is not None:
        links = TracedLinks(trace, robot.id, [other.id for other in mission.robots if other.id != robot.id])
        network = ShapedTransport(transport, links, clock, seed_for(mission, f"radio/{robot.id}"))
    shell = ProcessShell(Runner(agent, body, network, task.out / robot.id, links), clock)
    told_s = 0.0

    def stopped() -> bool:
        nonlocal told_s
        if time.monotonic() - told_s > STATUS_S:
            told_s = time.monotonic()
            pipe.send(Status(body.finished, len(agent.T_team_map) - 1, agent.known_area_m2()))
        return stop.is_set()

    shell.run(stopped)
