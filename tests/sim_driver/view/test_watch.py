"""What a robot's view is given when maps are bent: everything in the frame of its own map as it is."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from mrslam.sim_driver.view.frame import Frame
from mrslam.sim_driver.view.watch import ViewWatcher
from mrslam.spatial import Scan, se2
from tests.agent.test_joining import MAPS, A, align, joined, team_of


class Kept:
    """A stream that keeps its frames."""

    def __init__(self) -> None:
        self.frames: list[Frame] = []

    def open(self) -> None: ...

    def show(self, frame: Frame) -> None:
        self.frames.append(frame)

    def tell(self, event: object) -> None: ...

    def close(self) -> None: ...


def test_other_maps_and_teammates_lie_where_they_are_near_the_robot() -> None:
    team, last = team_of(), A.trail.T_map_key[-1]
    align(team)
    joined(team)
    beside = se2.compose(team.layout.keyframes()["a"].T_map_base[-1], se2.transform(1.0, 0.5, 0.1))
    scan = Scan(
        stamp_ns=0, ranges_m=np.ones(4, np.float32), angle_min_rad=0.0, angle_increment_rad=0.1, range_max_m=5.0
    )
    agent = SimpleNamespace(
        scan=scan, team=team, mode="distributed", node=SimpleNamespace(store=SimpleNamespace(maps=MAPS)),
        mapper=SimpleNamespace(particles=last[None]), teammates=lambda now_ns: {"b": beside},
        T_map_base=last, tracking=SimpleNamespace(is_on=False),
    )  # fmt: skip
    stream = Kept()
    watcher = ViewWatcher(stream)
    watcher.on_scan(agent, SimpleNamespace(scan=scan), 10**9)
    watcher.close(agent, 10**9)
    (frame,) = stream.frames
    assert se2.between(last, frame.teammates["b"]) == pytest.approx(se2.transform(1.0, 0.5, 0.1))
    assert np.array_equal(frame.T_own_map["a"], se2.IDENTITY)
    assert np.array_equal(frame.T_own_map["b"], team.layout.T_own_map("b"))
    assert not np.allclose(frame.T_own_map["b"], team.layout.T_team_map["b"], atol=1e-3)
