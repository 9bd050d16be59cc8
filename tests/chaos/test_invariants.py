"""The invariants notice what they are there for, and no lie is believed."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from bench.chaos.invariants import Invariants
from bench.chaos.schedule import LENGTH_S, chaos_tables
from mrslam.sim_driver.evaluate.truth import Judge
from mrslam.sim_driver.faults import KINDS
from mrslam.sim_driver.faults.liar import WAYS
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam, run_in_virtual_time
from mrslam.sim_driver.simulation.simulation import make_world
from tests.sim_driver.faults.small import quiet, small

S = 1_000_000_000


@pytest.mark.parametrize("seed", range(3))
def test_a_lie_is_not_believed(tmp_path: Path, seed: int) -> None:
    mission = small(tmp_path, {"kind": "liar", "robot": "r2", "for_s": 100.0}, duration_s=40.0, seed=seed)
    world = make_world(mission)
    invariants = Invariants(mission, Judge(world.grid, world.reachable))
    run_in_virtual_time(mission, tmp_path, quiet, invariants)
    assert invariants.violations == []
    assert len(WAYS) == 3


def test_invariants_notice_a_lost_map_a_forgotten_one_and_a_false_merge(tmp_path: Path) -> None:
    mission = small(tmp_path)
    world = make_world(mission)
    invariants = Invariants(mission, Judge(world.grid, world.reachable))

    def spoil(team: VirtualTeam, now_ns: int) -> None:
        agent = team.robots[0].runner.agent  # type: ignore[attr-defined]
        if now_ns == 12 * S:
            agent.T_team_map["r2"] = np.array([50.0, 0.0, 1.0])
        if now_ns == 15 * S:
            agent.node.store._newest.pop("r2")
        invariants(team, now_ns)

    run_in_virtual_time(mission, tmp_path, quiet, spoil)
    assert any("places r2" in line for line in invariants.violations)
    assert any("r1 knew r2" in line for line in invariants.violations)


def test_schedules_follow_from_their_seed_and_play_every_kind(tmp_path: Path) -> None:
    assert chaos_tables(5) == chaos_tables(5) != chaos_tables(6)
    assert chaos_tables(5, "hotel") == {**chaos_tables(5), "world": {"name": "hotel:5"}}
    kinds = set()
    for seed in range(80):
        mission = make_mission(chaos_tables(seed), tmp_path / "chaos.toml")
        kinds |= {fault.kind for fault in mission.faults}
        assert all(fault.end_s <= LENGTH_S or fault.kind in ("liar", "laser_off") for fault in mission.faults)
    assert kinds == set(KINDS)
