"""What the settings of the radio do to messages in virtual time."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from mrslam.comms import LinkConditions
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.run.run_virtual import VirtualTeam
from mrslam.spatial import InputError


def link(tmp_path: Path, **radio: Any) -> LinkConditions:
    """Return what the link of two robots is like at the beginning of a mission with these settings of its radio."""
    robots = [{"id": "r1", "start": [7.2, 4.2, 0.0]}, {"id": "r2", "start": [9.5, 4.0, 0.0]}]
    tables = {"mission": {"shell": "virtual"}, "world": {"name": "arena2"}, "robots": robots, "radio": radio}
    team = VirtualTeam(make_mission(tables, tmp_path / "two.toml"), tmp_path)
    assert team.simulation is not None
    team.simulation.advance(0)
    return team.network.conditions("r1", "r2", 0)


def test_messages_take_the_radios_time_and_queue_for_its_bandwidth(tmp_path: Path) -> None:
    weak = {"power_dbm": -30.0}
    usual, slow = link(tmp_path, **weak), link(tmp_path, **weak, latency_s=0.5, bandwidth_bit_s=2e4)
    assert usual == LinkConditions(loss=usual.loss) and 0.0 < usual.loss < 0.9
    assert slow == LinkConditions(loss=usual.loss, delay_s=0.5, rate_bps=2e4)
    assert link(tmp_path, range_m=0.1).loss == 1.0
    with pytest.raises(
        InputError, match=r"radio\.bandwidth_bit_s must be 0 \(no limit\), or 1 bit/s and more, got 0\.5"
    ):
        link(tmp_path, bandwidth_bit_s=0.5)
