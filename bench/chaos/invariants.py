"""What must hold at every step whatever goes wrong, and what users need, checked against the simulation's truth."""

from __future__ import annotations

from bench.chaos.carried_off import CarriedOff
from bench.chaos.doubt import Silence
from bench.chaos.knowledge import Knowledge
from bench.chaos.masking import Masking
from bench.chaos.merging import Flapping, Merging
from bench.chaos.places import Places
from bench.chaos.recovery import Recovery
from bench.chaos.scene import Frames, Report, Scene
from bench.chaos.team_maps import TeamMaps
from mrslam.agent import VirtualRobot
from mrslam.sim_driver.evaluate.truth import Judge
from mrslam.sim_driver.faults.robot import MortalRobot
from mrslam.sim_driver.missions.mission import Mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam


class Invariants:
    """Watches a mission; :attr:`violations` says what broke, each in a line."""

    def __init__(self, mission: Mission, judge: Judge) -> None:
        """Take the mission and its world."""
        self.report = Report()
        self._mission, self._judge, self._frames = mission, judge, Frames()
        self._knowledge = Knowledge(self.report)
        self._others = (
            Places(self.report), Merging(self.report), Flapping(self.report), TeamMaps(self.report),
            Masking(self.report), Silence(self.report), CarriedOff(self.report), Recovery(self.report),
        )  # fmt: skip

    @property
    def violations(self) -> list[str]:
        """What broke."""
        return self.report.violations

    def __call__(self, team: VirtualTeam, now_ns: int) -> None:
        """Look at all robots after a step."""
        scene = self._scene(team, now_ns)
        self._knowledge.step(scene)
        for robot_id, agent in scene.agents.items():
            self._frames.look(robot_id, agent, scene.T_world_base[robot_id], now_ns)
        for one in self._others:
            one.step(scene)

    def at_end(self, team: VirtualTeam, now_ns: int) -> None:
        """Look once more when all has healed and nothing new was seen for a while."""
        scene = self._scene(team, now_ns)
        for one in (self._knowledge, *self._others):
            one.at_end(scene)

    def _scene(self, team: VirtualTeam, now_ns: int) -> Scene:
        assert team.simulation is not None
        self.report.now_s = now_ns / 1e9
        robots = {r.runner.agent.robot_id: r for r in team.robots if isinstance(r, MortalRobot | VirtualRobot)}
        poses = team.simulation.fleet.T_world_base()
        return Scene(now_ns, self._mission, self._judge, team, robots, poses, self._frames)
