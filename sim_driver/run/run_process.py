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
        mission_s, interrupted = _Watch(mission, launcher, children, simulation, say).run(progress), False
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


class _Watch:
    """Moves mission time and the simulated world on, and follows the robots' processes to the end."""

    def __init__(
        self,
        mission: Mission,
        launcher: Launcher,
        children: list[Child],
        simulation: Simulation | None,
        say: Callable[[str], None],
    ) -> None:
        self._launcher, self._children, self._simulation, self._say = launcher, children, simulation, say
        self._mission = mission.mission
        self._pace = Pace(self._mission.speed)
        self._idle_since_s: float | None = None

    def run(self, progress: Any) -> float:
        """Watch until the mission is over; return how long it was, mission seconds."""
        total_s, step_s = self._total_s(), WATCH_S if self._simulation is None else STEP_NS / 4e9 / self._mission.speed
        while True:
            self._look_after_children()
            now_s = self._advance()
            progress(now_s, total_s, _words(self._children))
            if self._mission.duration_s is not None and now_s >= self._mission.duration_s:
                return self._mission.duration_s
            if self._is_over(now_s):
                return now_s
            time.sleep(step_s)

    def _total_s(self) -> float | None:
        """Return how long the mission will take, mission seconds; None where that is not known."""
        if self._mission.duration_s is not None or self._simulation is not None:
            return self._mission.duration_s
        return max(child.duration_s for child in self._children) + self._mission.linger_s

    def _look_after_children(self) -> None:
        """Read what the robots report; report those that died, and start them again where the mission says so."""
        now_s = self._launcher.now.value / 1e9
        for i, child in enumerate(self._children):
            child.read_status()
            for other in child.newly_placed():
                self._say(f"{now_s:.0f} s: {child.robot_id} knows where the map of {other} lies")
            if child.alive or child.death_reported:
                continue
            child.read_status()  # its last words may have come since
            child.death_reported = True
            again = self._mission.restart and child.restarts < MOST_RESTARTS and not child.failure
            self._say(f"{now_s:.0f} s: {_death(child)}" + ("; it is started again" if again else ""))
            if again:
                self._children[i] = self._launcher.revive(child)

    def _advance(self) -> float:
        """Move mission time and the simulated world on; return mission time, seconds."""
        now = self._launcher.now
        now.value += self._pace.step_ns([child for child in self._children if _is_behind(child)])
        if self._simulation is not None:
            _simulate(self._simulation, self._children, now.value)
        return now.value / 1e9

    def _is_over(self, now_s: float) -> bool:
        """Return whether all robots have finished and the time to linger is over, or none is alive."""
        if any(child.alive and not child.status.finished for child in self._children):
            self._idle_since_s = None
            return False
        if self._idle_since_s is None:
            self._idle_since_s = now_s
            return False
        has_lingered = now_s - self._idle_since_s >= self._mission.linger_s
        return has_lingered or not any(child.alive for child in self._children)


def _death(child: Child) -> str:
    code = child.process.exitcode or 0
    if child.failure:
        how = f"cannot go on: {child.failure}"
    elif code < 0:
        known = signal.Signals.__members__.values()
        how = f"was killed ({signal.Signals(-code).name if -code in known else f'signal {-code}'})"
    else:
        how = f"ended with code {code}"
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
        sensed = simulation.take(child.robot_id)
        try:
            while child.simulator.poll(0):
                news: RobotNews = child.simulator.recv()
                child.taken = news.taken
                simulation.command(child.robot_id, news.command)
            if sensed and child.ready and child.sent - child.taken < NEWS_AHEAD:
                newest = replace(sensed[-1], taken_s=time.monotonic())
                child.simulator.send(SimulatorNews([newest], simulation.qualities(child.robot_id)))
                child.sent += 1
                child.scans_lost += len(sensed) - 1
            else:
                child.scans_lost += len(sensed)  # it cannot keep up: newer scans will be worth more
        except (EOFError, OSError):
            simulation.command(child.robot_id, (0.0, 0.0))  # its process is gone; its body stands where it was
            child.scans_lost += len(sensed)


def _words(children: Sequence[Child]) -> str:
    return "  ".join(f"{child.robot_id} {child.status.known if child.alive else 'ended'}".strip() for child in children)
