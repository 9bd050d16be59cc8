"""What runs in a robot's own process."""

from __future__ import annotations

import os
import time
from dataclasses import dataclass
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event as StopEvent
from pathlib import Path

from mrslam.agent import Body, Counter, Keeper, ProcessShell, Runner, Sensed, SharedClock
from mrslam.comms import Transport, load_keys
from mrslam.sim_driver.kernels import load_kernels
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import CHECKPOINT
from mrslam.sim_driver.missions.sections import RobotConfig
from mrslam.sim_driver.missions.seeds import seed_for
from mrslam.sim_driver.missions.usage import write_usage
from mrslam.sim_driver.run.known_area import KnownArea
from mrslam.sim_driver.run.shaping import ShapedTransport
from mrslam.sim_driver.run.team import (
    go_online,
    make_agent,
    make_body,
    radio_of,
    read_trace,
    take_up,
    told_links,
    watchers_of,
)
from mrslam.sim_driver.simulation.recorded import RecordedBody
from mrslam.spatial import InputError

STATUS_S = 0.1
"""How often a robot tells the parent how it fares, seconds."""


@dataclass(frozen=True)
class RobotTask:
    """Everything a robot's process is given."""

    mission: Mission
    robot: RobotConfig
    out: Path
    listen: str
    connect: list[str]
    is_simulated: bool
    resumed: bool = False
    """Whether the robot had started before, and died."""


@dataclass(frozen=True)
class Ready:
    """Sent by a robot that has its log and its network."""

    duration_s: float


@dataclass(frozen=True)
class Failed:
    """Sent by a robot that cannot take part, in place of :class:`Ready`."""

    reason: str


@dataclass(frozen=True)
class Go:
    """Sent to all robots when all are ready: mission time begins."""


@dataclass(frozen=True)
class Status:
    """How a robot fares."""

    finished: bool = False
    placed: tuple[str, ...] = ()
    """Teammates whose maps lie beside its own."""
    known: str = ""
    """The area it knows and whose maps that is, in words."""
    behind_s: float = 0.0
    """How long the next scan has been due, seconds of mission time."""


@dataclass(frozen=True, eq=False)
class SimulatorNews:
    """What the simulation tells a robot at every step."""

    sensed: list[Sensed]
    qualities: dict[str, float]


@dataclass(frozen=True)
class RobotNews:
    """What a robot tells the simulation."""

    command: tuple[float, float]
    taken: int
    """How much news it has taken in all, so that the simulation never sends more than it can hold."""


class PipePort:
    """A robot's line to the simulation in the parent process."""

    def __init__(self, pipe: Connection) -> None:
        """Take the robot's end of the pipe."""
        self._pipe = pipe
        self._qualities: dict[str, float] = {}
        self._command = (0.0, 0.0)
        self._taken = 0

    def take(self) -> list[Sensed]:
        """Return the scans since the last call."""
        sensed: list[Sensed] = []
        while self._pipe.poll(0):
            news: SimulatorNews = self._pipe.recv()
            sensed += news.sensed
            self._qualities = news.qualities
            self._taken += 1
        if sensed:
            self._pipe.send(RobotNews(self._command, self._taken))
        return sensed

    def command(self, command: tuple[float, float]) -> None:
        """Say what to drive."""
        self._command = command
        self._pipe.send(RobotNews(command, self._taken))

    def qualities(self) -> dict[str, float]:
        """Return the true quality of the robot's links, as last told."""
        return self._qualities


def run_robot(task: RobotTask, pipe: Connection, simulator: Connection, stop: StopEvent, now: Counter) -> None:
    """Map, meet and merge until told to stop, then write the robot's files."""
    known = KnownArea()
    try:
        shell, body = _come_up(task, pipe, simulator, now, known)
    except InputError as error:
        pipe.send(Failed(str(error)))
        return
    agent, told_s = shell.runner.agent, 0.0

    def stopped() -> bool:
        nonlocal told_s
        if time.monotonic() - told_s > STATUS_S:
            told_s = time.monotonic()
            behind_s = 0.0 if body.next_ns is None else max(now.value - body.next_ns, 0) / 1e9
            placed = tuple(robot for robot in agent.T_team_map if robot != agent.robot_id)
            pipe.send(Status(body.finished, placed, known.words, behind_s))
        return stop.is_set()

    shell.run(stopped)
    write_usage(shell, task.out / task.robot.id)


def _come_up(
    task: RobotTask, pipe: Connection, simulator: Connection, now: Counter, known: KnownArea
) -> tuple[ProcessShell, Body]:
    """Load everything, say so, and wait for the common start."""
    mission, robot = task.mission, task.robot
    load_kernels()  # from disk, before the clock runs
    port = PipePort(simulator) if task.is_simulated else None
    body = make_body(mission, robot, port)
    agent = make_agent(mission, robot, boot_id=time.time_ns() // 1_000_000 % 2**31 + os.getpid() % 1000)
    folder = mission.links.keys
    keys = None if folder is None else load_keys(mission.find(folder) / robot.id, robot.id, mission.mission.name)
    transport: Transport = go_online(agent, listen=[task.listen], connect=task.connect, keys=keys)
    out = task.out / robot.id
    past = take_up(agent, out / CHECKPOINT, now.value) if task.resumed else []
    trace = read_trace(mission)
    pipe.send(Ready(getattr(body, "duration_ns", 0) / 1e9))
    pipe.recv()  # Go
    clock = SharedClock(now, mission.mission.speed)
    if task.resumed and isinstance(body, RecordedBody):
        body.skip_to(clock.now_ns())
    radio = radio_of(mission, robot, trace, port)
    if radio is not None:
        transport = ShapedTransport(transport, radio, clock, seed_for(mission, f"radio/{robot.id}"))
    watchers = [*watchers_of(mission, robot, out), known]
    keeper = Keeper(out / CHECKPOINT, agent.settings.agent.checkpoint_interval_s)
    runner = Runner(agent, body, transport, out, told_links(mission, radio), watchers, keeper)
    runner.perform(past)
    return ProcessShell(runner, clock), body
