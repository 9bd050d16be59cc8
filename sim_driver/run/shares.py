"""Robots of one mission in several processes: what these tell each other in every step of virtual time.

Each process plays the world and the network, which are cheap, and of the robots its own share. Nothing that a robot
does in a step is seen by another one before the step is over; so what they send and how they drive is all that is to be
told, and the same seed gives the same bytes with any number of processes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from multiprocessing.connection import Connection
from typing import Protocol

from mrslam.agent import VirtualRobot
from mrslam.comms import Send, Transport
from mrslam.sim_driver.simulation.simulation import Simulation


@dataclass(frozen=True)
class Turn:
    """What one robot's turn means to others."""

    robot_id: str
    sent: list[Send]
    command: tuple[float, float] | None
    """What it drives from now on, speed (m/s) and turn (rad/s); None where it never said, or nobody asks."""
    finished: bool


Turns = Mapping[str, Turn]
"""By robot."""


def turn_of(robot: VirtualRobot, simulation: Simulation | None) -> Turn:
    """Return what a robot of this process did in this step."""
    robot_id = robot.runner.agent.robot_id
    command = None if simulation is None else simulation.commands.get(robot_id)
    return Turn(robot_id, robot.outbox.waiting, command, robot.finished)


class AwayRobot:
    """A robot that takes its turns in another process: here it sends and drives as it is told to."""

    def __init__(self, robot_id: str, transport: Transport, simulation: Simulation | None) -> None:
        """Take its end of the network, and the world where it drives in one."""
        self.robot_id = robot_id
        self._transport, self._simulation = transport, simulation
        self._turn = Turn(robot_id, [], None, finished=False)

    def step(self, now_ns: int, worker: ThreadPoolExecutor) -> None:
        """Drop what arrived: the robot has it where it takes its turns."""
        self._transport.poll(0.0)

    def take(self, turn: Turn) -> None:
        """Take what the robot did in this step."""
        self._turn = turn
        if self._simulation is not None and turn.command is not None:
            self._simulation.command(self.robot_id, turn.command)

    def flush(self, now_ns: int) -> None:
        """Send what the robot had to send."""
        for effect in self._turn.sent:
            self._transport.send(effect)

    @property
    def finished(self) -> bool:
        """Whether there is nothing left for the robot to do."""
        return self._turn.finished

    def close(self, now_ns: int) -> None:
        """Leave the network."""
        self._transport.close()


class Meeting(Protocol):
    """Where the processes of a mission wait for each other in every step."""

    is_over: bool
    """Whether the mission ends early, after the present step."""

    def meet(self, turns: Turns) -> Turns:
        """Give the turns of the robots here; return those of all robots."""


class Hub:
    """The process that started the others: it collects the turns of all, and says whether the mission ends."""

    def __init__(self, pipes: Sequence[Connection], stop: Callable[[], bool]) -> None:
        """Take a pipe to each of the others, and what says whether to end the mission early."""
        self._pipes, self._stop = pipes, stop
        self.is_over = False

    def meet(self, turns: Turns) -> Turns:
        """Give the turns of the robots here; return those of all robots."""
        for pipe in self._pipes:
            turns = {**turns, **received(pipe)}
        self.is_over = self._stop()
        for pipe in self._pipes:
            pipe.send((turns, self.is_over))
        return turns


class Spoke:
    """One of the processes that were started."""

    def __init__(self, pipe: Connection) -> None:
        """Take its pipe to the hub."""
        self._pipe = pipe
        self.is_over = False

    def meet(self, turns: Turns) -> Turns:
        """Give the turns of the robots here; return those of all robots."""
        self._pipe.send(turns)
        told: tuple[Turns, bool] = self._pipe.recv()
        turns, self.is_over = told
        return turns


def received(pipe: Connection) -> Turns:
    """Return what one of the other processes says; raise what it failed at."""
    try:
        said: Turns | BaseException = pipe.recv()
    except EOFError:
        raise RuntimeError("a process in which robots of this mission took their turns has died") from None
    if isinstance(said, BaseException):
        raise said
    return said
