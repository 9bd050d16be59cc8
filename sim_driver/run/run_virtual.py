"""A mission in virtual time: all robots in this process, the same bytes for the same seed."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Collection, Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from mrslam.agent import Keeper, LinkSource, Runner, TakesTurns, VirtualRobot, Watcher, run_virtual
from mrslam.comms import Conditions, LinkConditions, MemoryNetwork, Transport
from mrslam.merge.joint.local_match import Answers
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.faults.links import CorruptingTransport, faulty_conditions
from mrslam.sim_driver.faults.robot import FaultyDisk, MortalRobot, Start, Twin
from mrslam.sim_driver.faults.senses import FaultySenses
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.missions.run_files import CHECKPOINT, TWIN
from mrslam.sim_driver.missions.sections import RobotConfig
from mrslam.sim_driver.missions.seeds import seed_for
from mrslam.sim_driver.run.shaping import CUT_BELOW
from mrslam.sim_driver.run.shares import AwayRobot, Meeting, turn_of
from mrslam.sim_driver.run.team import (
    NoBody,
    make_agent,
    make_body,
    radio_of,
    read_trace,
    take_up,
    told_links,
    watchers_of,
)
from mrslam.sim_driver.simulation.recorded import RecordedBody
from mrslam.sim_driver.simulation.simulated import DirectPort
from mrslam.sim_driver.simulation.simulation import Simulation, is_simulated
from mrslam.sim_driver.worlds.radio import RadioConfig

BOOTS_APART = 1000
"""Between the boot ids of two lives of a robot, as between start times in ms: its maps are counted on from one."""


class Kidnapper:
    """Carries kidnapped robots to where they do not know they are."""

    def __init__(self, mission: Mission) -> None:
        """Take the mission's kidnappings."""
        self._waiting = sorted(_of_kind(mission, "kidnapped"), key=lambda fault: fault.at_s)
        self._rng = np.random.default_rng(seed_for(mission, "kidnapped"))

    def inject_fault(self, simulation: Simulation, now_ns: int) -> None:
        """Carry away the robots whose kidnapping is due."""
        while self._waiting and self._waiting[0].at_s * 1e9 <= now_ns:
            fault = self._waiting.pop(0)
            simulation.kidnap(fault.robot, fault.amount, self._rng)


class VirtualWorld:
    """Network and simulated world, moved on together."""

    def __init__(self, network: MemoryNetwork, simulation: Simulation | None, kidnapper: Kidnapper) -> None:
        """Take both, and who carries robots about; a mission of recorded robots has no world."""
        self._network, self._simulation, self._kidnapper = network, simulation, kidnapper

    def advance(self, now_ns: int) -> None:
        """Move virtual time on."""
        if self._simulation is not None:
            self._kidnapper.inject_fault(self._simulation, now_ns)
            self._simulation.advance(now_ns)
        self._network.advance(now_ns)


def _conditions(radios: Mapping[str, LinkSource | None], config: RadioConfig) -> Conditions:
    """Return how every link is, by what the sender's radio says of it."""
    carries = {"delay_s": config.latency_s, "rate_bps": config.bandwidth_bit_s or math.inf}

    def conditions(sender: str, receiver: str, now_ns: int) -> LinkConditions:
        radio = radios.get(sender)
        quality = 1.0 if radio is None else radio.qualities(now_ns).get(receiver, 1.0)
        return replace(LinkConditions.of_quality(quality if quality >= CUT_BELOW else 0.0), **carries)

    return conditions


def _one_thread_a_mapper(mission: Mission) -> Mission:
    """Return the mission for robots that take their turns side by side: enough of them keep all cores busy."""
    if len(mission.robots) < len(os.sched_getaffinity(0)):
        return mission
    settled = {
        robot_id: settings if settings.rbpf.threads else replace(settings, rbpf=replace(settings.rbpf, threads=1))
        for robot_id, settings in mission.settings_of.items()
    }
    return replace(mission, settings_of=settled)


class VirtualTeam:
    """Makes the robots of a mission, at its beginning and again when one has died."""

    def __init__(self, mission: Mission, out: Path, here: Collection[str] | None = None) -> None:
        """Take the mission and where its robots' folders go.

        ``here`` : the robots that take their turns in this process, None = all; a mission with faults has all of them
        in one.
        """
        self._mission, self._out = mission, out
        self._settled = _one_thread_a_mapper(mission)
        self.simulation = Simulation(mission) if mission.world is not None and mission.replay is None else None
        if self.simulation is not None and here is not None:
            self.simulation.sensing = here
        self._trace = read_trace(mission)
        self._radios: dict[str, LinkSource | None] = {}
        self._watchers: dict[str, list[Watcher]] = {}
        self._matches = Answers()
        conditions = faulty_conditions(_conditions(self._radios, mission.radio), mission.faults)
        self.network = MemoryNetwork(seed_for(mission, "network"), conditions)
        self.duration_s = 0.0
        """How long the longest log is, mission seconds."""
        self.robots: list[TakesTurns] = [
            self._robot(robot) if here is None or robot.id in here else self._away(robot) for robot in mission.robots
        ]
        self.robots += [Twin(partial(self._start_twin, fault.robot), fault) for fault in _of_kind(mission, "twin")]

    def _robot(self, robot: RobotConfig) -> TakesTurns:
        faults = [fault for fault in self._mission.faults if fault.robot == robot.id]
        if not self._mission.faults:
            return VirtualRobot(self._start(robot, Start(), None))
        disk = FaultyDisk(faults)
        return MortalRobot(partial(self._start, robot, disk=disk), faults, partial(self._die, robot.id), disk)

    def _away(self, robot: RobotConfig) -> AwayRobot:
        port = self._port(robot)
        self._radios[robot.id] = radio_of(self._mission, robot, self._trace, port)
        simulation = self.simulation if port is not None else None
        return AwayRobot(robot.id, self.network.attach(robot.id), simulation)

    def meet(self, meeting: Meeting) -> None:
        """Exchange what the robots here did in this step for what those of other processes did."""
        here = [turn_of(robot, self.simulation) for robot in self.robots if isinstance(robot, VirtualRobot)]
        turns = meeting.meet({turn.robot_id: turn for turn in here})
        for robot in self.robots:
            if isinstance(robot, AwayRobot):
                robot.take(turns[robot.robot_id])

    def _die(self, robot_id: str) -> None:
        self.network.crash(robot_id)
        if self.simulation is not None:
            self.simulation.command(robot_id, (0.0, 0.0))

    def _start(self, robot: RobotConfig, start: Start, disk: FaultyDisk | None) -> Runner:
        """Make a robot; one that comes back has missed what there was to see meanwhile."""
        mission, folder = self._mission, self._out / robot.id
        faults = [fault for fault in mission.faults if fault.robot == robot.id]
        port = self._port(robot)
        body = make_body(mission, robot, port)
        if isinstance(body, RecordedBody):
            self.duration_s = max(self.duration_s, body.duration_ns / 1e9)
            body.skip_to(start.now_ns)
        elif port is not None and start.life:
            port.take()
        radio = self._radios[robot.id] = radio_of(mission, robot, self._trace, port)
        boot_id = seed_for(mission, f"boot/{robot.id}") + BOOTS_APART * start.life
        agent = make_agent(self._settled, robot, boot_id)
        transport: Transport = self.network.attach(robot.id)
        keeper = None
        if disk is not None:
            rng = np.random.default_rng([seed_for(mission, f"faults/{robot.id}"), start.life])
            body = FaultySenses(body, faults, rng)
            transport = CorruptingTransport(transport, faults, rng.spawn(1)[0], disk)
            keeper = Keeper(folder / CHECKPOINT, agent.settings.agent.checkpoint_interval_s, disk)
        past = take_up(agent, folder / CHECKPOINT, start.now_ns) if start.resumes else []
        if robot.id not in self._watchers:  # who looks on goes on doing so when the robot comes back
            self._watchers[robot.id] = watchers_of(mission, robot, folder)
        links, watchers = told_links(mission, radio), self._watchers[robot.id]
        runner = Runner(agent, body, transport, folder, links, watchers, keeper, self._matches)
        runner.perform(past)
        return runner

    def _port(self, robot: RobotConfig) -> DirectPort | None:
        if self.simulation is None or not is_simulated(self._mission, robot):
            return None
        return DirectPort(self.simulation, robot.id)

    def _start_twin(self, robot_id: str) -> Runner:
        """Make a second process with a robot's id, that senses nothing."""
        robot = next(robot for robot in self._mission.robots if robot.id == robot_id)
        agent = make_agent(self._settled, robot, boot_id=seed_for(self._mission, f"twin/{robot_id}"))
        radio = self._radios[robot_id]
        return Runner(
            agent, NoBody(), self.network.attach(robot_id, twin=True), self._out / robot_id / TWIN,
            told_links(self._mission, radio),
        )  # fmt: skip


def _of_kind(mission: Mission, kind: str) -> list[FaultConfig]:
    return [fault for fault in mission.faults if fault.kind == kind]


def run_in_virtual_time(
    mission: Mission,
    out: Path,
    progress: Any,
    watch: Callable[[VirtualTeam, int], None] = lambda team, now_ns: None,
    stop: Callable[[], bool] = lambda: False,
) -> dict[str, Any]:
    """Run the mission and return what the metrics need beside the robots' own files.

    ``watch`` is shown all robots after every step; the mission ends early where ``stop()`` says so.
    """
    team = VirtualTeam(mission, out)
    outcome = play(mission, team, progress, watch, stop)
    if team.simulation is not None:
        team.simulation.write_truth(out)
    return outcome


def play(
    mission: Mission,
    team: VirtualTeam,
    progress: Any,
    watch: Callable[[VirtualTeam, int], None] = lambda team, now_ns: None,
    stop: Callable[[], bool] = lambda: False,
    meeting: Meeting | None = None,
    threads: int = 0,
) -> dict[str, Any]:
    """Run a team's robots to the mission's end and return what the metrics need beside their files.

    ``meeting`` : where robots that take their turns in other processes are told of; ``threads`` : for alignments, where
    the mission leaves that open, 0 = the number of cores.
    """
    limit_s = mission.mission.duration_s
    total_s = limit_s or (team.duration_s + mission.mission.linger_s if team.simulation is None else None)

    def after_step(now_ns: int) -> None:
        progress(now_ns / 1e9, total_s, "")
        watch(team, now_ns)

    interrupted = False

    def is_over() -> bool:
        nonlocal interrupted
        interrupted = stop()
        return interrupted

    mission_ns = run_virtual(
        team.robots,
        VirtualWorld(team.network, team.simulation, Kidnapper(mission)),
        step_ns=round(mission.settings.agent.tick_s * 1e9),
        duration_ns=None if limit_s is None else round(limit_s * 1e9),
        linger_ns=round(mission.mission.linger_s * 1e9),
        progress=after_step,
        stop=is_over,
        threads=mission.settings.rbpf.threads or threads,
        meet=(lambda: None) if meeting is None else partial(team.meet, meeting),
    )
    return {"mission_s": mission_ns / 1e9, "shell": "virtual", **({"interrupted": True} if interrupted else {})}
