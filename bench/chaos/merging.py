"""Maps that overlap are merged, and stay merged."""

from __future__ import annotations

from collections import Counter
from itertools import permutations

import numpy as np

from bench.chaos.repeats import is_repeating
from bench.chaos.scene import Report, Scene
from mrslam.sim_driver.evaluate.truth import MUST_MERGE, Judge, overlap
from mrslam.spatial import se2

LOOKS_ALIKE = 0.7
"""A world of which a turn lays so much wall on wall fits its own turned self too well for anyone to be sure."""
WAIT_S = 40.0
"""Fault-free robots that hold each other's maps, overlapping enough, have merged them after so long. Measured: 10 s."""
UNMERGED_MOST = 2
"""A pair may be unmerged so often: once in a house that looks alike, and once more for what was corrected since; and
again so often by a robot that was resumed, which knows what its checkpoint holds. Measured: once."""


class Merging:
    """Fault-free robots that hold each other's maps, and whose maps overlap, merge them."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._ready_s: dict[tuple[str, str], float] = {}
        self._merged_s: dict[tuple[str, str], float] = {}
        self._alike: float | None = None

    def step(self, scene: Scene) -> None:
        """Note who could merge and who has."""
        agents = scene.agents
        for robot_id, agent in agents.items():
            for other in agent.T_team_map.keys() - {robot_id}:
                self._merged_s.setdefault((robot_id, other), scene.now_s)
        if not scene.is_due(2):
            return
        for one, other in permutations(agents, 2):
            if (one, other) in self._ready_s or scene.suffers(one) or scene.suffers(other):
                continue
            if self._shared(scene, one, other) >= MUST_MERGE:
                self._ready_s[one, other] = scene.now_s

    def _shared(self, scene: Scene, one: str, other: str) -> float:
        """Return the true overlap of a robot's map and what it holds of another's, 0..1."""
        agent = scene.agents[one]
        maps, frames = agent.node.store.maps, (scene.frame(agent, one), scene.frame(agent, other))
        if one not in maps or other not in maps or frames[0] is None or frames[1] is None:
            return 0.0
        return overlap(maps[one].map.to_grid(), maps[other].map.to_grid(), frames[0], frames[1])

    def at_end(self, scene: Scene) -> None:
        """Say who could have merged and is not merged, in a world that looks alike nowhere."""
        if self._alike is None:
            self._alike = 1.0 if is_repeating(scene) else alike(scene.judge)
        for (one, other), ready_s in self._ready_s.items():
            agent = scene.agents.get(one)
            if agent is None or scene.now_s - ready_s < WAIT_S:
                continue
            merged_s, is_merged = self._merged_s.get((one, other)), other in agent.T_team_map
            waited_s = None if merged_s is None else round(merged_s - ready_s, 1)
            self._report.figures["merge"].append([one, other, round(self._alike, 2), waited_s, is_merged])
            if self._alike >= LOOKS_ALIKE:
                continue
            if not is_merged:
                self._report.say(f"{one} could have merged the map of {other} since {ready_s:.0f} s, and has not")
            elif waited_s is not None and waited_s > WAIT_S:
                self._report.say(f"{one} merged the map of {other} only after {waited_s:.0f} s")


class Flapping:
    """A pair is not merged and unmerged by turns.

    What a liar makes of the team is no matter: it holds the map that it tells for its own.
    """

    def __init__(self, report: Report) -> None:
        self._report = report
        self._placed: dict[str, tuple[tuple[object, int] | None, dict[str, int]]] = {}
        self._lost: Counter[tuple[str, str]] = Counter()

    def step(self, scene: Scene) -> None:
        """Count whose place was lost though neither began another map."""
        for robot_id, agent in scene.agents.items():
            if scene.suffers(robot_id, "liar"):
                continue
            version = agent.node.store.version
            key = (agent, version(robot_id)[0])
            before_key, before = self._placed.get(robot_id, (None, {}))
            now = {other: version(other)[0] for other in agent.T_team_map.keys() - {robot_id}}
            self._placed[robot_id] = key, now
            if before_key is not None and before_key[0] is not agent:
                self._lost = Counter({pair: count for pair, count in self._lost.items() if pair[0] != robot_id})
            if before_key != key:
                continue
            for other in before.keys() - now.keys():
                if version(other)[0] == before[other]:
                    self._lost[robot_id, other] += 1
                    if self._lost[robot_id, other] == UNMERGED_MOST + 1:
                        self._report.say(f"{robot_id} unmerged the map of {other} {UNMERGED_MOST + 1} times")

    def at_end(self, scene: Scene) -> None:
        """Note how often each place was lost."""
        self._report.figures["unmerged"] += [[*pair, count] for pair, count in self._lost.items()]


def alike(judge: Judge) -> float:
    """Return how well the world fits itself turned by a quarter, a half or three quarters about its middle, 0..1."""
    walls = judge.world.centres(judge.world.is_occupied)
    middle = (walls.min(axis=0) + walls.max(axis=0)) / 2.0
    turned = []
    for quarter in (1, 2, 3):
        turn = np.array([0.0, 0.0, quarter * np.pi / 2.0])
        x, y = middle - se2.apply(turn, middle)
        turned.append(judge.occupied_precision(judge.world, se2.transform(x, y, turn[2])))
    return max(turned)
