"""How long after a fault everything is as it should be: the robot is sure of itself, and all hold what it maps."""

from __future__ import annotations

from dataclasses import dataclass

from bench.chaos.scene import Report, Scene
from mrslam.agent import Agent
from mrslam.sim_driver.faults import FaultConfig

RECOVERED_S = 35.0
"""By then. Measured: 22 s at most, after wheels that leapt while the laser was stuck."""
NEWS_S = 4.0
"""A robot that has published nothing for so long stands still: its newest map counts. Maps are published every 2 s."""
NEVER = ("liar",)
"""Faults without an end."""


@dataclass
class Case:
    """A fault that is over."""

    fault: FaultConfig
    before: tuple[int, int]
    """The version of the robot's map when it was over."""
    target: tuple[int, int] | None = None
    """The version that all must hold."""
    took_s: float | None = None


class Recovery:
    """Follows faults from their end."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._cases: list[Case] = []

    def step(self, scene: Scene) -> None:
        """Begin a case where a fault is over, and see whether robots have recovered."""
        begun = [case.fault for case in self._cases]
        for fault in scene.faults():
            agent = scene.agents.get(fault.robot)
            is_over = fault.kind not in NEVER and fault.end_s <= scene.now_s
            if is_over and fault not in begun and agent is not None and not _is_troubled(scene, fault.robot):
                self._cases.append(Case(fault, agent.node.store.version(fault.robot)))
        stopped = [name for name, agent in scene.agents.items() if agent.node.must_stop]  # while its twin was there
        self._cases = [case for case in self._cases if case.fault.robot not in stopped]
        for case in self._cases:
            agent = scene.agents.get(case.fault.robot)
            if case.took_s is None and agent is not None and self._has_recovered(scene, case, agent):
                case.took_s = scene.now_s - case.fault.end_s

    def _has_recovered(self, scene: Scene, case: Case, agent: Agent) -> bool:
        robot_id, since_s = case.fault.robot, scene.now_s - case.fault.end_s
        own = agent.node.store.version(robot_id)
        if case.target is not None and own[0] != case.target[0]:
            case.target = None  # that map is gone: the robot came back from a checkpoint before it, or began another
        if case.target is None and own > (0, 0) and (own > case.before or since_s > NEWS_S):
            case.target = own
        if case.target is None or agent.self_doubt.doubtful:
            return False
        others = [
            other for name, other in scene.agents.items()
            if name != robot_id and not other.node.must_stop and not _is_troubled(scene, name)
        ]  # fmt: skip
        return all(other.node.store.version(robot_id) >= case.target for other in others)

    def at_end(self, scene: Scene) -> None:
        """Say what took too long."""
        for case in self._cases:
            took_s = None if case.took_s is None else round(case.took_s, 1)
            fault = case.fault
            self._report.figures["recovery"].append([fault.kind, fault.robot, took_s])
            if took_s is None or took_s > RECOVERED_S:
                self._report.say(f"{fault.robot} has not recovered {RECOVERED_S:.0f} s after {fault.kind}: {took_s}")


def _is_troubled(scene: Scene, robot_id: str) -> bool:
    """Return whether a fault of the robot goes on."""
    return any(fault.kind not in NEVER and fault.active(scene.now_ns) for fault in scene.faults(robot_id))
