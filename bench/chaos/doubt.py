"""A robot that may be anywhere keeps its map to itself; one that is sure is right."""

from __future__ import annotations

from collections import defaultdict

from bench.chaos.scene import BLINDS, SPOILS, Report, Scene
from mrslam.agent import Agent

POSE_M = 1.0
"""A robot whose laser works and that does not doubt is no farther than this from where it believes to be, metres.
Measured: 0.4 at most."""
LOOKS_AGAIN_S = 3.0
"""So long after its laser worked again a robot may believe what its wheels said meanwhile."""


class Silence:
    """Nothing is published in doubt."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._before: dict[str, tuple[Agent, bool, tuple[int, int]]] = {}
        self._off_m: defaultdict[str, float] = defaultdict(float)

    def step(self, scene: Scene) -> None:
        """Compare versions, and places."""
        for robot_id, agent in scene.agents.items():
            version, doubts = agent.node.store.version(robot_id), agent.self_doubt.doubtful
            before, doubted, held = self._before.get(robot_id, (None, False, version))
            self._before[robot_id] = agent, doubts, version
            if before is agent and doubted and doubts and version != held:
                self._report.say(f"{robot_id} published its map though it doubts where it is")
            is_blind = any(
                fault.kind in BLINDS and fault.at_s <= scene.now_s < fault.end_s + LOOKS_AGAIN_S
                for fault in scene.faults(robot_id)
            )
            if not (doubts or is_blind or scene.suffers(robot_id, "liar", *SPOILS)):
                self._is_right(scene, robot_id, agent)

    def _is_right(self, scene: Scene, robot_id: str, agent: Agent) -> None:
        T_world_map = scene.frame(agent, robot_id)
        is_new = agent.scan is not None and agent.scan.stamp_ns == scene.now_ns
        is_of_this_map = agent.node.store.own_epoch == agent.node.store.version(robot_id)[0]
        if T_world_map is None or not is_new or not is_of_this_map:
            return
        off_m = scene.off_m(robot_id, T_world_map)
        if off_m > POSE_M >= self._off_m[robot_id]:
            self._report.say(f"{robot_id} is sure, and {off_m:.1f} m from where it believes to be")
        self._off_m[robot_id] = max(self._off_m[robot_id], off_m)

    def at_end(self, scene: Scene) -> None:
        """Note how far robots were off."""
        self._report.figures["pose"] += [[robot_id, round(off_m, 3)] for robot_id, off_m in self._off_m.items()]
