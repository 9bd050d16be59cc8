"""Teammates whose place is known are not taken for walls."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from bench.chaos.scene import SPOILS, Report, Scene
from mrslam.agent import Agent
from mrslam.sim_driver.evaluate.truth import FALSE_MERGE_M
from mrslam.sim_driver.robots.config import ChassisConfig
from mrslam.spatial import se2

NOISE_M = 0.05
"""A beam that hits a body ends within this of it: range noise is 5 mm and 0.5 %."""
UNMASKED_MOST = 0.5
"""Of the beams that hit teammates whose place is known at most this share is mapped. Measured: 0.37 at most."""
BEAMS_LEAST = 300
"""Fewer beams than this say nothing."""
UNHEARD = ("partition", "flapping", "corrupt", "twin", "crash", "amnesia", "clock")
"""Faults of robots whose whereabouts the others may not hear in time."""


class Masking:
    """Counts the beams that end at teammates and are not dropped."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._masked: defaultdict[str, int] = defaultdict(int)
        self._mapped: defaultdict[str, int] = defaultdict(int)
        self._before: dict[str, tuple[Agent, int]] = {}

    def step(self, scene: Scene) -> None:
        """Look at the scans of this step, as robots use them."""
        for robot_id, agent in scene.agents.items():
            before, masked = self._before.get(robot_id, (agent, 0))
            self._masked[robot_id] += agent.masked_beams - (masked if before is agent else 0)
            self._before[robot_id] = agent, agent.masked_beams
            mates = [mate for mate in agent.T_team_map if mate in scene.agents and _is_known(scene, agent, mate)]
            is_new = agent.scan is not None and agent.scan.stamp_ns == scene.now_ns
            if mates and is_new and not scene.suffers(robot_id, "laser_garbage", "laser_stuck"):
                self._mapped[robot_id] += self._at(scene, agent, [scene.T_world_base[mate][:2] for mate in mates])

    def _at(self, scene: Scene, agent: Agent, mates_m: list[NDArray[np.float64]]) -> int:
        assert agent.scan is not None
        T_world_base = scene.T_world_base[agent.robot_id]
        ends = se2.apply(T_world_base, agent.scan.points_base())
        reach_m = ChassisConfig().radius_m + NOISE_M
        return sum(int(np.count_nonzero(np.hypot(*(ends - mate).T) <= reach_m)) for mate in mates_m)

    def at_end(self, scene: Scene) -> None:
        """Judge the robots that know where they are."""
        for robot_id in scene.agents:
            masked, mapped = self._masked[robot_id], self._mapped[robot_id]
            if scene.suffers(robot_id, "liar", *SPOILS) or masked + mapped < BEAMS_LEAST:
                continue
            share = mapped / (masked + mapped)
            self._report.figures["unmasked"].append([robot_id, masked + mapped, round(share, 3)])
            if share > UNMASKED_MOST:
                self._report.say(f"{robot_id} took {100 * share:.0f} % of the beams that hit known teammates for walls")


def _is_known(scene: Scene, agent: Agent, mate: str) -> bool:
    """Return whether a robot hears where a teammate truly is, and its map is where it truly lies.

    In a house that looks alike it may not be. A robot that doubts where it is does not tell.
    """
    if scene.suffers(mate, *UNHEARD, *SPOILS) or scene.suffers(agent.robot_id, *UNHEARD):
        return False
    if scene.agents[mate].self_doubt.doubtful:
        return False
    own, there = scene.frame(agent, agent.robot_id), scene.frame(agent, mate)
    if mate == agent.robot_id or own is None or there is None:
        return False
    if se2.difference(agent.T_team_map[mate], se2.between(own, there))[0] > FALSE_MERGE_M:
        return False
    return scene.off_m(mate, there) <= FALSE_MERGE_M  # wheels may have leapt while it was blind
