"""What is random in a mission follows from its seed, and each thing differently."""

from __future__ import annotations

from pathlib import Path

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.seeds import seed_for


def test_each_purpose_has_its_own_seed() -> None:
    purposes = ("radio", "starts", "r1", "r2", "lies")
    found = {}
    for seed in (1, 2):
        tables = {"mission": {"seed": seed}, "world": {"name": "arena1"}, "robots": [{"id": "r1"}]}
        mission = make_mission(tables, Path("small.toml"))
        found[seed] = [seed_for(mission, purpose) for purpose in purposes]
        assert found[seed] == [seed_for(mission, purpose) for purpose in purposes]
    assert len({*found[1], *found[2]}) == 2 * len(purposes)
