"""What robots know: it only grows, it is what was given out, it fits into memory, and in the end all know the same."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field
from hashlib import blake2b
from itertools import combinations

from bench.chaos.scene import Report, Robot, Scene
from mrslam.agent import Agent
from mrslam.merge.graph.tree import components
from mrslam.sim_driver.faults.robot import MortalRobot

Version = tuple[int, int]
SHRINKS_TO = 0.6
"""A map that goes on may shrink by being corrected, but not to less than this share of its largest area."""
MOST_QUEUED = 5000
"""More messages than this on their way are no bounded queue."""


@dataclass
class Life:
    """What is remembered of one robot."""

    digest: dict[str, Version] = field(default_factory=dict)
    saved: dict[str, Version] = field(default_factory=dict)
    """Its digest when its checkpoint was last written."""
    frozen: dict[str, Version] = field(default_factory=dict)
    """Its digest when it last tried to write one."""
    saved_m2: float = 0.0
    frozen_m2: float = 0.0
    """The area of its map at these times."""
    agent: Agent | None = None
    largest_m2: float = 0.0
    epoch: int = 0


class Knowledge:
    """Watches what every robot holds."""

    def __init__(self, report: Report) -> None:
        self._report = report
        self._lives: defaultdict[str, Life] = defaultdict(Life)
        self._contents: dict[tuple[str, Version], bytes] = {}
        self._checked: dict[tuple[str, str], Version] = {}

    def step(self, scene: Scene) -> None:
        """Look at all robots."""
        for robot_id, robot in scene.robots.items():
            if robot_id not in scene.agents:
                self._lives[robot_id].digest = {}
                continue
            agent = robot.runner.agent
            self._came_up(robot_id, agent, scene)
            self._is_monotone(robot_id, agent, robot, scene)
            self._map_is_not_lost(robot_id, agent)
            self._contents_are_true(robot_id, agent)
            self._is_bounded(robot_id, agent, len(scene.robots))
        if scene.team.network.queued > MOST_QUEUED:
            self._report.say(f"{scene.team.network.queued} messages are on their way")

    def _came_up(self, robot_id: str, agent: Agent, scene: Scene) -> None:
        life = self._lives[robot_id]
        if life.agent is agent:
            return
        goes_on = bool(agent.node.store.maps) and life.agent is not None
        if not goes_on:  # what it had saved is gone
            life.saved, life.saved_m2 = {}, 0.0
        scene.frames.resumed(robot_id, agent, goes_on=goes_on)
        life.agent, life.digest, life.largest_m2 = agent, life.saved, life.saved_m2

    def _is_monotone(self, robot_id: str, agent: Agent, robot: Robot, scene: Scene) -> None:
        life, digest = self._lives[robot_id], agent.node.store.digest()
        for other, version in life.digest.items():
            if digest.get(other, (0, 0)) < version:
                self._report.say(f"{robot_id} knew {other} at {version} and knows it at {digest.get(other)} now")
        life.digest = digest
        keeper = robot.runner.keeper
        if keeper is not None:
            if keeper.frozen_ns == _clock_ns(robot, scene.now_ns):
                life.frozen, life.frozen_m2 = digest, agent.known_area_m2()
            if keeper.saved_ns == keeper.frozen_ns:
                life.saved, life.saved_m2 = life.frozen, life.frozen_m2

    def _map_is_not_lost(self, robot_id: str, agent: Agent) -> None:
        life, epoch, area_m2 = self._lives[robot_id], agent.node.store.own_epoch, agent.known_area_m2()
        if epoch != life.epoch:  # a map that was given up is gone before the next one is published
            life.epoch, life.largest_m2 = epoch, 0.0
        if area_m2 < SHRINKS_TO * life.largest_m2:
            self._report.say(f"the map of {robot_id} shrank from {life.largest_m2:.1f} to {area_m2:.1f} m2")
        life.largest_m2 = max(life.largest_m2, area_m2)

    def _contents_are_true(self, robot_id: str, agent: Agent) -> None:
        """One version of a map is one content, whoever holds it."""
        for owner, version in agent.node.store.digest().items():
            if self._checked.get((robot_id, owner)) == version:
                continue
            self._checked[robot_id, owner] = version
            snapshot = agent.node.store.newest(owner)
            assert snapshot is not None
            digest = blake2b(digest_size=16)
            for place in sorted(snapshot.map.tiles):
                cells = snapshot.map.tiles[place].cells
                if (cells != -1).any():
                    digest.update(repr(place).encode() + cells.tobytes())
            content = digest.digest()
            if owner == robot_id:
                known = self._contents.setdefault((owner, version), content)
            else:
                known = self._contents.get((owner, version), b"")
            if known != content:
                self._report.say(f"{robot_id} holds {owner} at {version} with a content that {owner} never gave")

    def _is_bounded(self, robot_id: str, agent: Agent, count: int) -> None:
        staged, pairs = len(agent.node.staged_maps.staging), len(agent.team.beliefs)
        if staged > count or pairs > count**2:
            self._report.say(f"{robot_id} keeps {staged} half maps and {pairs} pairs")

    def at_end(self, scene: Scene) -> None:
        """All that live and hear each other know the same when all has healed and nothing new was seen for a while."""
        live = {name: agent.node.store.digest() for name, agent in scene.agents.items() if not agent.node.must_stop}
        for group in components(live, [pair for pair in combinations(sorted(live), 2) if scene.hears(*pair)]):
            if len({repr(live[name]) for name in group}) > 1:
                known = {name: live[name] for name in group}
                self._report.say(f"after healing the robots do not know the same: {known}")


def _clock_ns(robot: Robot, now_ns: int) -> int:
    """Return what the robot's clock shows."""
    return robot.local_ns(now_ns) if isinstance(robot, MortalRobot) else now_ns
