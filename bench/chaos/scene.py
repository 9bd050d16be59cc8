"""One step of a mission as those who judge it see it: the robots that live, and the truth about them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from mrslam.agent import Agent, VirtualRobot
from mrslam.sim_driver.evaluate.truth import Judge
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.faults.robot import MortalRobot
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

Robot = MortalRobot | VirtualRobot
SPOILS = ("kidnapped",)
"""Faults after which a robot's own map may be wrong, and with it the place of its frame."""
BLINDS = ("laser_stuck", "laser_garbage")
"""Faults during which only the wheels tell where a robot is."""
HEARD = 0.8
"""Least share of messages that arrive between robots that hear each other: well above the missions' threshold of 0.5,
for their links are measured over eight beacons."""
REST = "laser_off"
"""All lasers are off at a mission's end, which is no fault of one robot."""


@dataclass
class Report:
    """What was found to be broken, each in a line, and what was measured."""

    violations: list[str] = field(default_factory=list)
    figures: defaultdict[str, list[Any]] = field(default_factory=lambda: defaultdict(list))
    """By name: plain JSON values, as many as there were occasions."""
    now_s: float = 0.0

    def say(self, text: str) -> None:
        """Note that something broke now."""
        self.violations.append(f"{self.now_s:.1f} s: {text}")


class Frames:
    """Where in the world the frame of each map is: where its robot was at its first scan.

    A robot that drove blind by its wheels has a map that is off by what they were wrong from there on: its frame by its
    last scan (:meth:`by_last_scan`) is another one, in which what it sees now is true.
    """

    def __init__(self) -> None:
        self._by_last_scan: dict[tuple[str, int], Transform] = {}
        self._of: defaultdict[str, dict[int, Transform]] = defaultdict(dict)
        self._mapper: dict[str, object] = {}
        self._begun: dict[str, Transform] = {}  # of maps that were not published yet
        self._epoch: dict[str, int] = {}

    def resumed(self, robot_id: str, agent: Agent, *, goes_on: bool) -> None:
        """A robot came up: with the map of its checkpoint where it ``goes_on``, else with none."""
        self._mapper[robot_id] = agent.mapper if goes_on else None

    def look(self, robot_id: str, agent: Agent, T_world_base: Transform, now_ns: int) -> None:
        """Note where a new map begins, and under which label it is published; and where it is by a scan of now."""
        known = self._of[robot_id]
        if agent.mapper is not self._mapper.get(robot_id) and agent.mapper.stats.processed:
            self._mapper[robot_id] = agent.mapper
            self._begun[robot_id] = T_world_base
        epoch = agent.node.store.version(robot_id)[0]
        if epoch == 0:
            return
        if epoch not in known:
            if robot_id in self._begun:
                known[epoch] = self._begun.pop(robot_id)
            elif (before := self._epoch.get(robot_id)) in known:
                known[epoch] = known[before]  # the same map under a new label
        self._epoch[robot_id] = epoch
        is_new = agent.scan is not None and agent.scan.stamp_ns == now_ns
        if is_new and epoch == agent.node.store.own_epoch and not agent.self_doubt.doubtful:
            T_base_map = se2.inverse(agent.mapper.T_map_base)
            self._by_last_scan[robot_id, epoch] = se2.compose(T_world_base, T_base_map)

    def by_last_scan(self, robot_id: str, epoch: int) -> Transform | None:
        """Return ``T_world_map`` by the last scan that a robot took on this map without doubts, None where none is."""
        return self._by_last_scan.get((robot_id, epoch))

    def of(self, robot_id: str, epoch: int) -> Transform | None:
        """Return ``T_world_map`` of this map of a robot, None where it is not known."""
        return self._of[robot_id].get(epoch)


@dataclass(frozen=True)
class Scene:
    """A step of a mission."""

    now_ns: int
    mission: Mission
    judge: Judge
    team: VirtualTeam
    robots: Mapping[str, Robot]
    """By id, dead ones too."""
    T_world_base: Mapping[str, Transform]
    """Where robots truly are."""
    frames: Frames

    @property
    def now_s(self) -> float:
        """Mission time, seconds."""
        return self.now_ns / 1e9

    def is_due(self, every_s: int) -> bool:
        """Return whether a whole number of so many seconds has passed."""
        return self.now_ns % (every_s * 1_000_000_000) == 0

    @property
    def agents(self) -> dict[str, Agent]:
        """The robots that live, by id."""
        return {name: r.runner.agent for name, r in self.robots.items() if isinstance(r, VirtualRobot) or r.alive}

    def hears(self, a: str, b: str) -> bool:
        """Return whether the radio reaches from where one robot is to the other; without a world it does."""
        simulation = self.team.simulation
        return simulation is None or simulation.radio.quality(self.T_world_base[a], self.T_world_base[b]) >= HEARD

    def frame(self, holder: Agent, robot_id: str) -> Transform | None:
        """Return ``T_world_map`` of the map of a robot that ``holder`` has, None where there is none."""
        return self.frames.of(robot_id, holder.node.store.version(robot_id)[0])

    def frame_now(self, holder: Agent, robot_id: str) -> Transform | None:
        """Return the same by the robot's last scan if it ever drove blind: what it has mapped since is true there."""
        T_world_map, epoch = self.frame(holder, robot_id), holder.node.store.version(robot_id)[0]
        if T_world_map is None or not self.suffers(robot_id, *BLINDS):
            return T_world_map
        by_last_scan = self.frames.by_last_scan(robot_id, epoch)
        return T_world_map if by_last_scan is None else by_last_scan

    def strayed_m(self, holder: Agent, robot_id: str) -> float:
        """Return how far what a robot sees now is from where its map had it when it began; ``holder`` has the map."""
        begun, now = self.frame(holder, robot_id), self.frame_now(holder, robot_id)
        if begun is None or now is None:
            return 0.0
        here = self.T_world_base[robot_id]
        return se2.difference(here, se2.compose(begun, se2.compose(se2.inverse(now), here)))[0]

    def off_m(self, robot_id: str, T_world_map: Transform) -> float:
        """Return how far a robot is from where it believes to be, metres; ``T_world_map`` : of its own map."""
        believed = se2.compose(T_world_map, self.agents[robot_id].mapper.T_map_base)
        return se2.difference(believed, self.T_world_base[robot_id])[0]

    def faults(self, robot_id: str | None = None) -> Iterator[FaultConfig]:
        """Yield the faults of one robot, or of all, but for the rest at the end."""
        for fault in self.mission.faults:
            if fault.kind != REST and robot_id in (None, fault.robot):
                yield fault

    def suffers(self, robot_id: str, *kinds: str) -> bool:
        """Return whether the mission has such a fault for the robot; without kinds: any."""
        return any(not kinds or fault.kind in kinds for fault in self.faults(robot_id))
