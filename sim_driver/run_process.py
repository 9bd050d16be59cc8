"""A mission as real processes: one a robot, over Zenoh on this machine, by explicit addresses."""

from __future__ import annotations

import multiprocessing as mp
import multiprocessing.connection
import signal
import socket
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from multiprocessing.context import SpawnProcess
from multiprocessing.synchronize import Event as StopEvent
from pathlib import Path
from typing import Any

from agent.clock import Counter
from sim_driver.mission import Mission
from sim_driver.robot_process import Failed, Go, Ready, RobotNews, RobotTask, SimulatorNews, Status, run_robot
from sim_driver.simulation import STEP_NS, Simulation, is_simulated
from spatial import InputError

READY_S = 120.0
"""Longest wait for a robot's process to come up, seconds."""
BEHIND_S = 2.0
"""Mission time waits for a robot whose recorded scans have been due for longer, seconds of mission time."""
PATIENCE_S = 10.0
"""... but no longer than this, seconds: a robot that hangs must not stop the others."""
LONGEST_STEP_S = 0.1
"""Mission time never jumps by more than this much wall time, seconds."""
NEWS_AHEAD = 5
"""Most scans on the way to one robot: a pipe that fills up would hold up all."""
WATCH_S = 0.05
"""How often the parent looks after its robots, seconds."""
CLOSE_S = 60.0
"""Longest wait for a robot's process to write its files, seconds."""


@dataclass
class Child:
    """One robot's process, as the parent sees it."""

    robot_id: str
    process: SpawnProcess
    pipe: multiprocessing.connection.Connection
    simulator: multiprocessing.connection.Connection
    duration_s: float = 0.0
    status: Status = field(default_factory=Status)
    sent: int = 0
    taken: int = 0
    """News of the simulation sent to it, and taken by it."""
    scans_lost: int = 0
    """Simulated scans it was too slow to take."""

    @property
    def alive(self) -> bool:
        """Whether the process still runs."""
        return self.process.is_alive()


def run_processes(mission: Mission, out: Path, progress: Any) -> dict[str, Any]:
    """Run the mission and return what the metrics need beside the robots' own files."""
    context = mp.get_context("spawn")  # numba's and zenoh's threads do not survive a fork
    stop = context.Event()
    now = context.Value("q", 0, lock=False)  # mission time, ns: written here, read by all robots
    simulation = Simulation(mission) if mission.world is not None else None
    children = _spawn(mission, out, stop, now)
    try:
        _await_ready(children)
        for child in children:
            child.pipe.send(Go())
        mission_s, interrupted = _watch(mission, children, simulation, now, progress), False
    except KeyboardInterrupt:  # what the robots have by now is worth keeping
        mission_s, interrupted = now.value / 1e9, True
    finally:
        stop.set()
        _close(children)
    if simulation is not None:
        simulation.write_truth(out)
    return {
        "mission_s": mission_s,
        "shell": "process",
        "interrupted": interrupted,
        "exit_codes": {child.robot_id: child.process.exitcode for child in children},
        "scans_lost": {child.robot_id: child.scans_lost for child in children},
    }


def _spawn(mission: Mission, out: Path, stop: StopEvent, now: Counter) -> list[Child]:
    context = mp.get_context("spawn")
    ports = free_ports(len(mission.robots))
    children = []
    on_interrupt = signal.signal(signal.SIGINT, signal.SIG_IGN)  # inherited: Ctrl-C is for the parent alone
    for i, robot in enumerate(mission.robots):
        here, there = context.Pipe()
        sim_here, sim_there = context.Pipe()
        connect = [_address(mission, port) for port in ports[:i]]
        task = RobotTask(mission, robot, out, _address(mission, ports[i]), connect, is_simulated(mission, robot))
        process = context.Process(target=run_robot, args=(task, there, sim_there, stop, now), name=f"mrslam-{robot.id}")
        process.start()
        there.close()
        sim_there.close()
        children.append(Child(robot.id, process, here, sim_here))
    signal.signal(signal.SIGINT, on_interrupt)
    return children


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


def _address(mission: Mission, port: int) -> str:
    return f"{'tcp' if mission.links.keys is None else 'tls'}/127.0.0.1:{port}"


def _await_ready(children: Sequence[Child]) -> None:
    """Wait until every process has its log and its network, so that all start together."""
    deadline = time.monotonic() + READY_S
    for child in children:
        while not child.pipe.poll(0.1):
            if not child.alive:
                raise RuntimeError(
                    f"the process of {child.robot_id} ended with code {child.process.exitcode} before it was ready"
                )
            if time.monotonic() > deadline:
                raise RuntimeError(f"the process of {child.robot_id} was not ready within {READY_S:.0f} s")
        answer: Ready | Failed = child.pipe.recv()
        if isinstance(answer, Failed):
            raise InputError(f"robot {child.robot_id}: {answer.reason}")
        child.duration_s = answer.duration_s


def _watch(
    mission: Mission, children: Sequence[Child], simulation: Simulation | None, now: Counter, progress: Any
) -> float:
    """Move the simulated world on and follow the robots to the end; return how long it was, mission seconds."""
    limit_s = mission.mission.duration_s
    total_s = limit_s or max(child.duration_s for child in children) + mission.mission.linger_s
    idle_since_s: float | None = None
    pace = Pace(mission.mission.speed)
    while True:
        _read_status(children)
        now.value += pace.step_ns(any(_is_behind(child) for child in children))
        if simulation is not None:
            _simulate(simulation, children, now.value)
        now_s = now.value / 1e9
        progress(now_s, total_s, _words(children))
        if limit_s is not None and now_s >= limit_s:
            return limit_s
        busy = [child for child in children if child.alive and not child.status.finished]
        if busy:
            idle_since_s = None
        elif idle_since_s is None:
            idle_since_s = now_s
        elif now_s - idle_since_s >= mission.mission.linger_s or not any(child.alive for child in children):
            return now_s
        time.sleep(WATCH_S if simulation is None else STEP_NS / 4e9 / mission.mission.speed)


class Pace:
    """How fast mission time passes: by the wall clock times a speed, but not while a robot is behind."""

    def __init__(self, speed: float) -> None:
        """Begin now."""
        self._speed = speed
        self._last_s = self._on_time_s = time.monotonic()

    def step_ns(self, hold: bool) -> int:
        """Return by how much to move mission time on; robots that are behind are waited for ``PATIENCE_S`` at most."""
        now_s = time.monotonic()
        passed_s, self._last_s = now_s - self._last_s, now_s
        if not hold:
            self._on_time_s = now_s
        elif now_s - self._on_time_s < PATIENCE_S:
            return 0
        return round(min(passed_s, LONGEST_STEP_S) * self._speed * 1e9)


def _is_behind(child: Child) -> bool:
    return child.alive and (child.sent - child.taken >= NEWS_AHEAD or child.status.behind_s > BEHIND_S)


def _simulate(simulation: Simulation, children: Sequence[Child], now_ns: int) -> None:
    """Move the world on; hand every robot what it senses, and take what it drives."""
    simulation.advance(now_ns)
    for child in children:
        try:
            while child.simulator.poll(0):
                news: RobotNews = child.simulator.recv()
                child.taken = news.taken
                simulation.command(child.robot_id, news.command)
            sensed = simulation.take(child.robot_id)
            if sensed and child.sent - child.taken < NEWS_AHEAD:
                child.simulator.send(SimulatorNews(sensed[-1:], simulation.qualities(child.robot_id)))
                child.sent += 1
                child.scans_lost += len(sensed) - 1
            else:
                child.scans_lost += len(sensed)  # it cannot keep up: newer scans will be worth more
        except (EOFError, OSError):
            simulation.command(child.robot_id, (0.0, 0.0))  # its process is gone; its body stands where it was


def _read_status(children: Sequence[Child]) -> None:
    for child in children:
        try:
            while child.pipe.poll(0):
                child.status = child.pipe.recv()
        except (EOFError, OSError):
            continue  # it ended; ``alive`` tells


def _words(children: Sequence[Child]) -> str:
    parts = []
    for child in children:
        merged = f"+{child.status.merged}" if child.status.merged else ""
        parts.append(
            f"{child.robot_id}{merged} {child.status.area_m2:.0f} m2" if child.alive else f"{child.robot_id} ended"
        )
    return "  ".join(parts)


def _close(children: Sequence[Child]) -> None:
    deadline = time.monotonic() + CLOSE_S
    for child in children:
        child.process.join(max(0.1, deadline - time.monotonic()))
        if child.alive:
            child.process.kill()
            child.process.join()
        child.pipe.close()
        child.simulator.close()
