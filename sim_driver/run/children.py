"""Robots' processes, as the parent sees them: started, started again when they die, and ended."""

from __future__ import annotations

import multiprocessing as mp
import os
import signal
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnProcess
from pathlib import Path

from mrslam.agent import Counter
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.run.robot_process import Failed, Go, Ready, RobotTask, Status, run_robot
from mrslam.sim_driver.simulation.simulation import is_simulated
from mrslam.spatial import InputError

READY_S = 120.0
"""Longest wait for a robot's process to come up, seconds."""
CLOSE_S = 60.0
"""Longest wait for a robot's process to write its files, seconds."""
MOST_RESTARTS = 100
"""A robot that dies more often than this stays dead."""


@dataclass
class Child:
    """One robot's process."""

    task: RobotTask
    process: SpawnProcess
    pipe: Connection
    simulator: Connection
    ready: bool = False
    """Whether it has come up."""
    restarts: int = 0
    """How often it was started again."""
    death_reported: bool = False
    """Whether its death was reported."""
    failure: str = ""
    """Why it could not come up again, where it said so."""
    duration_s: float = 0.0
    status: Status = field(default_factory=Status)
    sent: int = 0
    taken: int = 0
    """Messages of the simulation sent to it, and taken by it."""
    scans_lost: int = 0
    """Simulated scans it was too slow to take, or not there to take."""
    placed: set[str] = field(default_factory=set)
    """Teammates whose maps it was reported to have placed."""

    @property
    def robot_id(self) -> str:
        """The robot's name."""
        return self.task.robot.id

    @property
    def alive(self) -> bool:
        """Whether the process still runs."""
        return self.process.is_alive()

    def newly_placed(self) -> list[str]:
        """Return the teammates whose maps it has placed for the first time since the last call."""
        new = [other for other in self.status.placed if other not in self.placed]
        self.placed.update(new)
        return new

    def read_status(self) -> None:
        """Take what the process said since the last call."""
        try:
            while self.pipe.poll(0):
                said: Status | Ready | Failed = self.pipe.recv()
                if isinstance(said, Ready):  # it died and came up again: it need not wait for anyone
                    self.ready = True
                    self.pipe.send(Go())
                elif isinstance(said, Status):
                    self.status = said
                else:
                    self.failure = said.reason
        except (EOFError, OSError):
            return  # it ended; ``alive`` tells


class Launcher:
    """Starts the processes of one mission."""

    def __init__(self, mission: Mission, out: Path) -> None:
        """Prepare what all of them share."""
        self._mission = mission
        self._context = mp.get_context("spawn")  # numba's and zenoh's threads do not survive a fork
        self.stop = self._context.Event()
        self.now: Counter = self._context.Value("q", 0, lock=False)
        """Mission time, ns: written by the parent, read by all robots."""
        kind = "tcp" if mission.links.keys is None else "tls"
        addresses = [f"{kind}/127.0.0.1:{port}" for port in free_ports(len(mission.robots))]
        self._tasks = [
            RobotTask(mission, robot, out, addresses[i], addresses[:i], is_simulated(mission, robot))
            for i, robot in enumerate(mission.robots)
        ]
        self._addresses = addresses

    def start_all(self) -> list[Child]:
        """Start every robot; return when all have come up and may begin together."""
        children = [self._start(task) for task in self._tasks]
        try:
            _await_ready(children)
        except BaseException:
            self.end(children)
            raise
        for child in children:
            child.pipe.send(Go())
        return children

    def _start(self, task: RobotTask) -> Child:
        here, there = self._context.Pipe()
        sim_here, sim_there = self._context.Pipe()
        arguments = (task, there, sim_there, self.stop, self.now)
        os.environ.setdefault("MALLOC_ARENA_MAX", "2")  # inherited: a heap a thread makes robots 10 MB larger
        process = self._context.Process(target=run_robot, args=arguments, name=f"mrslam-{task.robot.id}")
        on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited: Ctrl-C is for the parent alone
        process.start()
        signal.signal(signal.SIGINT, on_interrupt)
        there.close()
        sim_there.close()
        return Child(task, process, here, sim_here)

    def revive(self, child: Child) -> Child:
        """Return a process that continues for a dead one, from its checkpoint; it comes up in its own time."""
        child.pipe.close()
        child.simulator.close()
        others = [address for address in self._addresses if address != child.task.listen]
        new = self._start(replace(child.task, connect=others, resumed=True))
        new.restarts, new.duration_s, new.scans_lost = child.restarts + 1, child.duration_s, child.scans_lost
        return new

    def end(self, children: Sequence[Child]) -> None:
        """Tell all to stop, and wait until they have written their files."""
        self.stop.set()
        deadline = time.monotonic() + CLOSE_S
        for child in children:
            while child.alive and time.monotonic() < deadline:
                child.read_status()  # one that has just come up again still has a checkpoint to write files from
                child.process.join(0.1)
            if child.alive:
                child.process.kill()
                child.process.join()
            child.pipe.close()
            child.simulator.close()


def _await_ready(children: Sequence[Child]) -> None:
    """Wait until every process has its log and its network."""
    deadline = time.monotonic() + READY_S
    for child in children:
        while not child.pipe.poll(0.1):
            if not child.alive:
                raise _never_ready(child)
            if time.monotonic() > deadline:
                raise InputError(
                    f"the process of {child.robot_id} was not ready within {READY_S:.0f} s; what it said is above"
                )
        try:
            answer: Ready | Failed = child.pipe.recv()
        except EOFError:
            child.process.join(CLOSE_S)
            raise _never_ready(child) from None
        if isinstance(answer, Failed):
            raise InputError(f"robot {child.robot_id}: {answer.reason}")
        child.duration_s, child.ready = answer.duration_s, True


def _never_ready(child: Child) -> InputError:
    return InputError(
        f"the process of {child.robot_id} ended with code {child.process.exitcode} before it was ready; "
        "what it said of that is above"
    )


def free_ports(count: int) -> list[int]:
    """Return TCP ports that are free on the loopback address now."""
    sockets = [socket.socket(socket.AF_INET, socket.SOCK_STREAM) for _ in range(count)]
    try:
        for one in sockets:
            one.bind(("127.0.0.1", 0))
        return [one.getsockname()[1] for one in sockets]
    finally:
        for one in sockets:
            one.close()
