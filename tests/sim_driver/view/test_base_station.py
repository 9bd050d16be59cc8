"""The recording of a base station, which has no laser: it shows the maps that it has."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

from mrslam.agent import Agent, Event, Settings
from mrslam.sim_driver.view import ViewOptions, watch_robot
from tests.agent.test_team import arrives, room


def test_its_recording_shows_the_maps_it_has(tmp_path: Path) -> None:
    base = Agent("base", Settings(), mode="central")
    watcher = watch_robot("base", tmp_path, ViewOptions(record=True, robots=("base",)))
    watcher.on_event(base, Event(0, "peer_seen", {"peer": "b"}))
    arrives(base, "b", room())
    base.team_map()  # places the map, as ticks do
    watcher.close(base, 1_000_000_000)
    told = subprocess.run(
        [sys.executable, "-m", "rerun", "rrd", "print", "-v", str(tmp_path / "view.rrd")],
        capture_output=True, text=True, check=True,
    ).stdout  # fmt: skip
    assert "/base/maps/b/grid" in told and "/base/maps/b/path" in told
    assert "/base/scan" not in told and "/base/robot" not in told
