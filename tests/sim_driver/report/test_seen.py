"""When a robot first saw a place: from its scans, one at least wherever it moved or turned, at mission time."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Sensed
from mrslam.sim_driver.report import seen as module
from mrslam.sim_driver.report.layout import Layout
from mrslam.sim_driver.report.seen import first_seen_s, mission_trajectory
from mrslam.spatial import Scan

S = 1_000_000_000


def looking_ahead(stamp_ns: int) -> Scan:
    """A scan of one beam, 3 m long."""
    return Scan(
        stamp_ns=stamp_ns, ranges_m=np.full(1, 3.0, dtype=np.float32), angle_min_rad=0.0, angle_increment_rad=0.1,
        range_max_m=10.0,
    )  # fmt: skip


def run(poses: np.ndarray, log: str | None = None, began_s: float = 0.0, shell: str = "virtual") -> Any:
    robot = SimpleNamespace(id="r1", log=log)
    mission = SimpleNamespace(robots=[robot], mission=SimpleNamespace(shell=shell))
    stamps = np.arange(len(poses)) * S
    way = stamps, poses
    return SimpleNamespace(
        mission=mission, trajectory=lambda robot: way, began_s=lambda robot: began_s, events={"r1": []}
    )


def test_a_robot_that_turns_on_the_spot_sees_what_is_around_it(monkeypatch: pytest.MonkeyPatch) -> None:
    poses = np.array([[5.0, 5.0, turn] for turn in (0.0, 0.1, np.pi / 2, np.pi)])
    scans = [Sensed(k * S, looking_ahead(k * S), None) for k in range(4)]
    monkeypatch.setattr(module, "_scans", lambda run, robot: scans)
    layout = Layout("r1", "r1", {"r1": np.zeros(3)}, ("r1",), 0.25, np.zeros((40, 40), dtype=np.int8))
    seen = first_seen_s(run(poses), layout, "r1")
    assert [seen[20, 30], seen[30, 20], seen[20, 10]] == [0.0, 2.0, 3.0]
    assert not np.isfinite(seen[22, 31])  # turned too little to be looked at anew


@pytest.mark.parametrize(("log", "shell"), [("a.log", "virtual"), (None, "agents")])
def test_who_began_late_saw_nothing_before(log: str | None, shell: str) -> None:
    late = run(np.zeros((3, 3)), log, began_s=40.0, shell=shell)
    assert (mission_trajectory(late, "r1")[0] / S).tolist() == [40.0, 41.0, 42.0]
    assert (mission_trajectory(run(np.zeros((3, 3)), began_s=40.0), "r1")[0] / S).tolist() == [0.0, 1.0, 2.0]
