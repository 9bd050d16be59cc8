"""A simulated robot drives by what its agent knows now."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.simulation.simulated import DirectPort, SimulatedBody
from mrslam.sim_driver.simulation.simulation import Simulation

MS = 1_000_000
PLACE = np.array([7.0, 8.0, 0.5])
"""Where the robot is in the team's map, which is what it plans on."""


class Driver:
    """Notes what it is shown, and turns on the spot."""

    finished = False

    def __init__(self) -> None:
        self.shown: list[tuple[Any, ...]] = []

    def command(self, now_ns: int, pose: Any, grid: Any, teammates: Any, scan: Any = None) -> tuple[float, float]:
        self.shown.append((now_ns, pose, grid, scan.stamp_ns))
        return 0.0, 0.5


def test_ten_times_a_second_it_drives_by_the_newest_scan_on_a_map_of_a_second_and_a_half_ago_at_most(tmp_path) -> None:
    tables = {"mission": {"shell": "virtual"}, "world": {"name": "arena1"}, "robots": [{"id": "r1"}]}
    simulation, driver, made = Simulation(make_mission(tables, tmp_path / "m.toml")), Driver(), []

    def planning_grid() -> int:
        made.append(len(made))
        return made[-1]

    agent: Any = SimpleNamespace(
        planning_grid=planning_grid, T_team_base=PLACE, T_map_base=np.zeros(3), teammates=lambda now_ns: {}
    )
    body = SimulatedBody(DirectPort(simulation, "r1"), driver)
    before = simulation.fleet.T_world_base()["r1"].copy()
    body.act(agent, 0)
    assert not driver.shown  # it has seen nothing yet
    for now_ns in range(0, 5_000 * MS, 50 * MS):
        simulation.advance(now_ns)
        while body.sense(now_ns) is not None:
            pass
        body.act(agent, now_ns)
    assert [now_ns // MS for now_ns, *_ in driver.shown] == list(range(0, 5_000, 100))
    assert all(pose is PLACE and stamp_ns == now_ns for now_ns, pose, _, stamp_ns in driver.shown)
    assert [grid for *_, grid, _ in driver.shown] == [k // 15 for k in range(50)]
    turned = simulation.fleet.T_world_base()["r1"] - before
    assert np.hypot(*turned[:2]) < 0.01 < abs(turned[2])
