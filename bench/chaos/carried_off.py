"""A robot that somebody carries off notices it, in a world that looks alike nowhere."""

from __future__ import annotations

from dataclasses import dataclass

from bench.chaos.merging import LOOKS_ALIKE, alike
from bench.chaos.scene import BLINDS, Report, Scene
from mrslam.agent import Agent
from mrslam.sim_driver.faults import FaultConfig

NOTICED_S = 5.0
"""Within this the robot doubts, or is right again. Measured: 0.1 s, its first scan, in most missions; 0.8 s at most."""
RIGHT_M = 0.5
"""A robot nearer than this to where it believes to be is right."""


@dataclass
class Case:
    """One kidnapping."""

    fault: FaultConfig
    mapper: object
    """The robot's, the moment before."""
    noticed_s: float | None = None


class CarriedOff:
    """Follows kidnappings."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._cases: list[Case] = []
        self._mappers: dict[str, object] = {}

    def step(self, scene: Scene) -> None:
        """Begin a case where one is due, and see whether robots have noticed."""
        begun = [case.fault for case in self._cases]
        for fault in scene.faults():
            agent = scene.agents.get(fault.robot)
            if fault.kind == "kidnapped" and fault not in begun and fault.at_s <= scene.now_s and agent is not None:
                self._cases.append(Case(fault, self._mappers.get(fault.robot)))
        for case in self._cases:
            agent = scene.agents.get(case.fault.robot)
            if agent is not None and case.noticed_s is None:
                self._look(scene, case, agent)
        for robot_id, agent in scene.agents.items():
            self._mappers[robot_id] = agent.mapper

    def _look(self, scene: Scene, case: Case, agent: Agent) -> None:
        T_world_map = scene.frame(agent, agent.robot_id)
        if agent.mapper is not case.mapper or agent.self_doubt.doubtful:
            case.noticed_s = scene.now_s - case.fault.at_s
            return
        if T_world_map is None or agent.scan is None or agent.scan.stamp_ns != scene.now_ns:
            return
        off_m = scene.off_m(agent.robot_id, T_world_map)
        if off_m < RIGHT_M:
            case.noticed_s = scene.now_s - case.fault.at_s

    def at_end(self, scene: Scene) -> None:
        """Say who did not notice though nothing kept it from looking."""
        for case in self._cases:
            robot_id, noticed_s = case.fault.robot, case.noticed_s
            looks, at_s = round(alike(scene.judge), 2), case.fault.at_s
            self._report.figures["carried off"].append([robot_id, looks, at_s, noticed_s and round(noticed_s, 1)])
            is_known = looks >= LOOKS_ALIKE or scene.mission.world is None
            if is_known or scene.suffers(robot_id, *BLINDS, "crash", "amnesia", "slow"):
                continue
            if noticed_s is None or noticed_s > NOTICED_S:
                self._report.say(f"{robot_id} was carried off at {at_s:.1f} s and did not notice")
