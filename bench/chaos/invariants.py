"""What must hold at every step whatever goes wrong, checked against the truth of the simulation."""

from __future__ import annotations

from dataclasses import dataclass, field
from hashlib import blake2b
from typing import TYPE_CHECKING

import numpy as np

from mrslam.agent import Agent, VirtualRobot
from mrslam.comms import CommsNode
from mrslam.sim_driver.evaluate.truth import Judge
from mrslam.sim_driver.faults.robot import MortalRobot
from mrslam.sim_driver.missions.mission import Mission
from mrslam.spatial import se2
from mrslam.spatial.se2 import Transform

if TYPE_CHECKING:
    from mrslam.sim_driver.run.run_virtual import VirtualTeam

Version = tuple[int, int]
FALSE_M, FALSE_RAD = 1.0, np.radians(10.0)
"""A placement farther off is a false merge."""
ALIKE = 0.9
"""A world looks the same after a motion that lays this much of its walls on its walls."""
KNOWABLE_M = 2.0
"""Who has seen so much true wall stand on true floor has seen that it does not."""
LIE_PRECISION = 0.6
"""A liar's map that lies on the true walls with less of its own is a false merge."""
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
    mapper: object | None = None
    frames: dict[int, Transform] = field(default_factory=dict)
    """By epoch of its map: where the map's frame is in the world."""
    largest_m2: float = 0.0
    epoch: int = 0


class Invariants:
    """Watches a mission; :attr:`violations` says what broke, each in a line."""

    def __init__(self, mission: Mission, judge: Judge) -> None:
        """Take the mission and its world."""
        self.violations: list[str] = []
        self._mission, self._judge = mission, judge
        self._lives: dict[str, Life] = {robot.id: Life() for robot in mission.robots}
        self._contents: dict[tuple[str, Version], bytes] = {}
        self._checked: dict[str, Version] = {}
        self._liars = {fault.robot for fault in mission.faults if fault.kind == "liar"}
        self._spoilt = {fault.robot for fault in mission.faults if fault.kind in SPOILS}
        self._now_s = 0.0

    def __call__(self, team: VirtualTeam, now_ns: int) -> None:
        """Look at all robots after a step."""
        self._now_s = now_ns / 1e9
        robots = {r.runner.agent.robot_id: r for r in team.robots if isinstance(r, MortalRobot | VirtualRobot)}
        for robot_id, robot in robots.items():
            if isinstance(robot, MortalRobot) and not robot.alive:
                self._lives[robot_id].digest = {}
                continue
            self._knowledge_is_monotone(robot_id, robot)
            self._frame(robot_id, robot.runner.agent, team)
            self._contents_are_true(robot_id, robot.runner.agent.node)
            self._map_is_not_lost(robot_id, robot.runner.agent)
            self._queues_are_bounded(robot_id, robot.runner.agent)
        if now_ns % 1_000_000_000 == 0:
            for robot_id, robot in robots.items():
                if isinstance(robot, VirtualRobot) or robot.alive:
                    self._merges_are_true(robot_id, robot.runner.agent)
        if team.network.queued > MOST_QUEUED:
            self._say(f"{team.network.queued} messages are on their way")

    def _say(self, text: str) -> None:
        self.violations.append(f"{self._now_s:.1f} s: {text}")

    def _knowledge_is_monotone(self, robot_id: str, robot: MortalRobot | VirtualRobot) -> None:
        life, agent = self._lives[robot_id], robot.runner.agent
        digest = agent.node.store.digest()
        before = life.digest
        if life.agent is not agent:
            resumed = agent.node.store.maps and life.agent is not None
            if not resumed:  # what it had saved is gone
                life.saved, life.saved_m2 = {}, 0.0
            before = life.saved
            life.agent, life.mapper = agent, agent.mapper if resumed else None
            life.largest_m2 = life.saved_m2
        for other, version in before.items():
            if digest.get(other, (0, 0)) < version:
                self._say(f"{robot_id} knew {other} at {version} and knows it at {digest.get(other)} now")
        life.digest = digest
        keeper = robot.runner.keeper
        if keeper is not None:
            if keeper.frozen_ns == agent_time(robot, self._now_s):
                life.frozen, life.frozen_m2 = digest, agent.known_area_m2()
            if keeper.saved_ns == keeper.frozen_ns:
                life.saved, life.saved_m2 = life.frozen, life.frozen_m2

    def _frame(self, robot_id: str, agent: Agent, team: VirtualTeam) -> None:
        """Note where in the world a new map of a robot begins."""
        life = self._lives[robot_id]
        if agent.mapper is not life.mapper and agent.mapper.stats.processed and team.simulation is not None:
            life.mapper = agent.mapper
            life.frames[-1] = team.simulation.fleet.T_world_base()[robot_id]  # until it is published
        own = agent.node.store.newest(robot_id)
        if own is not None and own.epoch not in life.frames:
            if -1 in life.frames:
                life.frames[own.epoch] = life.frames.pop(-1)
            elif life.epoch in life.frames:
                life.frames[own.epoch] = life.frames[life.epoch]  # the same map under a new label
        if own is not None:
            if own.epoch != life.epoch:
                life.largest_m2 = 0.0
            life.epoch = own.epoch

    def _contents_are_true(self, robot_id: str, node: CommsNode) -> None:
        """One version of a map is one content, whoever holds it."""
        for owner, version in node.store.digest().items():
            if self._checked.get(f"{robot_id}/{owner}") == version:
                continue
            self._checked[f"{robot_id}/{owner}"] = version
            snapshot = node.store.newest(owner)
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
                self._say(f"{robot_id} holds {owner} at {version} with a content that {owner} never gave")

    def _map_is_not_lost(self, robot_id: str, agent: Agent) -> None:
        life = self._lives[robot_id]
        area_m2 = agent.known_area_m2()
        if area_m2 < SHRINKS_TO * life.largest_m2:
            self._say(f"the map of {robot_id} shrank from {life.largest_m2:.1f} to {area_m2:.1f} m2")
        life.largest_m2 = max(life.largest_m2, area_m2)

    def _queues_are_bounded(self, robot_id: str, agent: Agent) -> None:
        staging = agent.node.arrivals.staging
        if len(staging) > len(self._lives) or len(agent.team.beliefs) > len(self._lives) ** 2:
            self._say(f"{robot_id} keeps {len(staging)} half maps and {len(agent.team.beliefs)} pairs")

    def _merges_are_true(self, robot_id: str, agent: Agent, *, at_end: bool = False) -> None:
        """Whom a robot has placed lies where it should, judged by where the maps' frames are in the world.

        Where the whole world, moved as the map is misplaced, looks the same, nobody can know who has not seen where it
        does not. Who has must, at the end.
        """
        own = self._frame_of(robot_id, agent.node.store.version(robot_id)[0])
        if own is None or robot_id in self._liars or robot_id in self._spoilt:
            return
        for other, T_own_other in agent.T_team_map.items():
            if other == robot_id or other in self._spoilt:
                continue
            there = self._frame_of(other, agent.node.store.version(other)[0])
            if there is None:
                continue
            if other in self._liars:
                grid = agent.node.store.maps[other].map.to_grid()
                share = self._judge.occupied_precision(grid, se2.compose(own, T_own_other))
                if share < LIE_PRECISION:
                    self._say(f"{robot_id} believes the lie of {other}: {100 * share:.0f} % of its walls are true")
                continue
            off_m, off_rad = se2.difference(T_own_other, se2.between(own, there))
            if off_m <= FALSE_M and off_rad <= FALSE_RAD:
                continue
            moved = se2.compose(se2.compose(own, T_own_other), se2.inverse(there))
            is_alike = self._judge.occupied_precision(self._judge.world, moved) >= ALIKE
            if is_alike and not (at_end and self._could_know(agent, (robot_id, own), (other, there), moved)):
                continue
            self._say(f"{robot_id} places {other} {off_m:.2f} m and {np.degrees(off_rad):.1f} deg off")

    def _could_know(
        self, agent: Agent, own: tuple[str, Transform], other: tuple[str, Transform], moved: Transform
    ) -> bool:
        """Return whether two maps, one moved in the world, show enough that cannot be at one place."""
        one, two = ((agent.node.store.maps[name].map.to_grid(), T_world_map) for name, T_world_map in (own, other))
        shown_m = self._judge.contradiction_m(two, one, moved) + self._judge.contradiction_m(
            one, two, se2.inverse(moved)
        )
        return shown_m >= KNOWABLE_M

    def _frame_of(self, robot_id: str, epoch: int) -> Transform | None:
        return self._lives[robot_id].frames.get(epoch)

    def at_end(self, team: VirtualTeam) -> None:
        """All that live know the same and nothing false when all has healed and nothing new was seen for a while."""
        agents = [
            r.runner.agent
            for r in team.robots
            if isinstance(r, VirtualRobot) or (isinstance(r, MortalRobot) and r.alive)
        ]
        for agent in agents:
            self._merges_are_true(agent.robot_id, agent, at_end=True)
        nodes: dict[str, CommsNode] = {agent.robot_id: agent.node for agent in agents}
        live = {name: node.store.digest() for name, node in nodes.items() if not node.must_stop}
        if len({repr(digest) for digest in live.values()}) > 1:
            self._say(f"after healing the robots do not know the same: {live}")


SPOILS = ("kidnapped",)
"""Faults after which a robot's own map may be wrong, and with it the place of its frame."""


def agent_time(robot: MortalRobot | VirtualRobot, now_s: float) -> int:
    """Return what the robot's clock shows."""
    now_ns = round(now_s * 1e9)
    return robot.local_ns(now_ns) if isinstance(robot, MortalRobot) else now_ns
