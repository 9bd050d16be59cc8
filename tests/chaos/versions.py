"""Maps as judges of chaos know them: by their robot and version."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from mrslam.sim_driver.faults import FaultConfig

S = 1_000_000_000


Version = tuple[int, int]


class Team:
    """Robots whose state a test sets, and the scene that judges see."""

    def __init__(self, *names: str, faults: tuple[FaultConfig, ...] = ()) -> None:
        self.agents: dict[str, Any] = {name: self._agent(name) for name in names}
        self.all_faults, self.now_s = faults, 0.0
        self.T_world_base = {name: np.zeros(3) for name in names}
        self.T_world_map: dict[str, np.ndarray] = {name: np.zeros(3) for name in names}
        self.judge = SimpleNamespace(world=None, occupied_precision=lambda *told: 1.0)
        self.mission = SimpleNamespace(world=SimpleNamespace(name="arena2"))
        self.walls = 0

    def _agent(self, name: str) -> Any:
        versions: dict[str, Version] = {}
        store = SimpleNamespace(
            versions=versions, version=lambda other: versions.get(other, (0, 0)), own_epoch=1, maps={}
        )
        layout = SimpleNamespace(placement=SimpleNamespace(edges=()))
        return SimpleNamespace(
            robot_id=name, node=SimpleNamespace(store=store, must_stop=False), mapper=object(), scan=None,
            team=SimpleNamespace(layout=layout), masked_beams=0, self_doubt=SimpleNamespace(doubtful=False),
            T_team_map={name: np.zeros(3)},
        )  # fmt: skip

    def at(self, now_s: float) -> Any:
        """Return the scene at a time; every robot has a scan of it."""
        self.now_s = now_s
        for agent in self.agents.values():
            agent.scan = SimpleNamespace(stamp_ns=round(now_s * S), points_base=lambda: np.zeros((0, 2)))
        return SimpleNamespace(
            now_s=now_s, now_ns=round(now_s * S), agents=self.agents, judge=self.judge, mission=self.mission,
            T_world_base=self.T_world_base, faults=self.faults, suffers=self.suffers, is_due=lambda every: True,
            frame=lambda holder, name: self.T_world_map[name], strayed_m=lambda holder, name: 0.0, off_m=self.off_m,
            team=SimpleNamespace(simulation=SimpleNamespace(radio=SimpleNamespace(walls=lambda a, b: self.walls))),
        )  # fmt: skip

    def faults(self, robot_id: str | None = None) -> list[FaultConfig]:
        return [fault for fault in self.all_faults if robot_id in (None, fault.robot)]

    def suffers(self, robot_id: str, *kinds: str) -> bool:
        return any(not kinds or fault.kind in kinds for fault in self.faults(robot_id))

    def off_m(self, robot_id: str, T_world_map: np.ndarray) -> float:
        return float(np.hypot(*(self.T_world_base[robot_id] - T_world_map)[:2]))


def fault(kind: str, robot: str = "r1", at_s: float = 10.0, for_s: float = 5.0) -> FaultConfig:
    return FaultConfig(kind=kind, robot=robot, at_s=at_s, for_s=for_s, amount=2.0)
