"""A mission as real processes: one a robot, over Zenoh on this machine, by explicit addresses."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.run.children import MOST_RESTARTS, Child, Launcher
from mrslam.sim_driver.run.robot_process import RobotNews, SimulatorNews
from mrslam.sim_driver.simulation.simulation import STEP_NS, Simulation

BEHIND_S = 2.0
"""Mission time waits for a robot whose recorded scans have been due for longer, seconds of mission time."""
PATIENCE_S = 10.0
"""... unless it has done nothing for so long, seconds: a robot that hangs must not stop the others."""
LONGEST_STEP_S = 0.1
"""Mission time never jumps by more than this much wall time, seconds."""
NEWS_AHEAD = 5
"""Most scans on the way to one robot: a pipe that fills up would hold up all."""
WATCH_S = 0.05
"""How often the parent looks after its robots, seconds."""


def run_processes(mission: Mission, out: Path, progress: Any, say: Callable[[str], None]) -> dict[str, Any]:
    """Run the mission and return what the metrics need beside the robots' own files."""
    simulation = Simulation(mission) if mission.world is not None else None
    launcher = Launcher(mission, out)
    children = launcher.start_all()
    try:
        mission_s, interrupted = _watch(mission, launcher, children, simulation, progress, say), False
    except KeyboardInterrupt:  # what the robots have by now is worth keeping
        mission_s, interrupted = launcher.now.value / 1e9, True
    finally:
        launcher.end(children)
    if simulation is not None:
        simulation.write_truth(out)
    return {
        "mission_s": mission_s,
        "shell": "process",
        "interrupted": interrupted,
        "exit_codes": {child.robot_id: child.process.exitcode for child in children},
        "restarts": {child.robot_id: child.restarts for child in children},
        "scans_lost": {child.robot_id: child.scans_lost for child in children},
    }


def _watch(
    mission: Mission,
    launcher: Launcher,
    children: list[Child],
    simulation: Simulation | None,
    progress: Any,
    say: Callable[[str], None],
) -> float:
    """Move the simulated world on and follow the robots to the end; return how long it was, mission seconds."""
    now = launcher.now
    limit_s = mission.mission.duration_s
    played_s = max(child.duration_s for child in children) if simulation is None else None
    total_s = limit_s or (None if played_s is None else played_s + mission.mission.linger_s)
    idle_since_s: float | None = None
    pace = Pace(mission.mission.speed)
    while True:
        for i, child in enumerate(children):
            child.read_status()
            for other in child.newly_placed():
                say(f"{now.value / 1e9:.0f} s: {child.robot_id} knows where the map of {other} lies")
            if child.alive or child.mourned:
                continue
            child.mourned = True
            again = mission.mission.restart and child.restarts < MOST_RESTARTS
            say(f"{now.value / 1e9:.0f} s: {_death(child)}" + ("; it is started again" if again else ""))
            if again:
                children[i] = launcher.revive(child)
        now.value += pace.step_ns([child for child in children if _is_behind(child)])
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


def _death(child: Child) -> str:
    code = child.process.exitcode or 0
    how = f"was killed ({signal.Signals(-code).name})" if code < 0 else f"ended with code {code}"
    return f"the process of {child.robot_id} {how}"


class Pace:
    """How fast mission time passes: by the wall clock times a speed, but not while a robot is behind and working."""

    def __init__(self, speed: float) -> None:
        """Begin now."""
        self._speed = speed
        self._last_s = time.monotonic()
        self._progress: dict[str, tuple[object, float]] = {}

    def step_ns(self, behind: Sequence[Child]) -> int:
        """Return by how much to move mission time on.

        Robots that are behind are waited for as long as they get on; one that does not for ``PATIENCE_S`` hangs.
        """
        now_s = time.monotonic()
        passed_s, self._last_s = now_s - self._last_s, now_s
        if sum(self._is_worth_waiting_for(child, now_s) for child in behind):  # each is looked at
            return 0
        return round(min(passed_s, LONGEST_STEP_S) * self._speed * 1e9)

    def _is_worth_waiting_for(self, child: Child, now_s: float) -> bool:
        done = child.taken, child.status.behind_s
        before, since_s = self._progress.get(child.robot_id, (None, now_s))
        if done != before:
            since_s = now_s
        self._progress[child.robot_id] = done, since_s
        return now_s - since_s < PATIENCE_S


def _is_behind(child: Child) -> bool:
    return child.alive and child.ready and (child.sent - child.taken >= NEWS_AHEAD or child.status.behind_s > BEHIND_S)


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
            if sensed and child.ready and child.sent - child.taken < NEWS_AHEAD:
                newest = replace(sensed[-1], taken_s=time.monotonic())
                child.simulator.send(SimulatorNews([newest], simulation.qualities(child.robot_id)))
                child.sent += 1
                child.scans_lost += len(sensed) - 1
            else:
                child.scans_lost += len(sensed)  # it cannot keep up: newer scans will be worth more
        except (EOFError, OSError):
            simulation.command(child.robot_id, (0.0, 0.0))  # its process is gone; its body stands where it was


def _words(children: Sequence[Child]) -> str:
    parts = []
    for child in children:
        merged = f"+{len(child.status.placed)}" if child.status.placed else ""
        parts.append(
            f"{child.robot_id}{merged} {child.status.area_m2:.0f} m2" if child.alive else f"{child.robot_id} ended"
        )
    return "  ".join(parts)
