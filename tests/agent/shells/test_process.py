"""The process shell: it stops for an older twin, and gives particles up only where a mapper holds up its robot."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from mrslam.agent import (
    Agent,
    Inline,
    Keeper,
    ProcessShell,
    Runner,
    Sensed,
    Settings,
    SharedClock,
    WallClock,
)
from mrslam.comms import MemoryNetwork, Send
from mrslam.rbpf import Mapper
from mrslam.spatial import Scan

S = 1_000_000_000
DEADLINE_S = 60.0
SETTINGS = Settings(rbpf=replace(Settings().rbpf, particles=16, threads=1))


class LateLaser:
    """Scans that were all taken a second ago."""

    next_ns = None
    finished = False
    scans_lost = 0

    def __init__(self, most: int) -> None:
        self.left = most

    def sense(self, now_ns: int) -> Sensed | None:
        if not self.left:
            return None
        self.left -= 1
        ranges = np.full(90, 3.0, dtype=np.float32)
        scan = Scan(
            stamp_ns=now_ns - S, ranges_m=ranges, angle_min_rad=-1.5, angle_increment_rad=0.03, range_max_m=10.0
        )
        return Sensed(now_ns - S, scan, np.zeros(3))

    def act(self, agent: Any, now_ns: int) -> None:
        """Nothing to drive."""


def test_a_robot_whose_name_another_process_has_already_stops(tmp_path: Path) -> None:
    network, time_ns = MemoryNetwork(), SimpleNamespace(value=0)
    older, end = Agent("r1", SETTINGS, boot_id=1), network.attach("r1")

    def live() -> None:
        time_ns.value += S // 10
        network.advance(time_ns.value)
        for item in end.poll():
            older.node.on_event(item, time_ns.value)
        for effect in older.on_tick(time_ns.value):
            if isinstance(effect, Send):
                end.send(effect)

    while time_ns.value < 5 * S:
        live()
    twin = Agent("r1", SETTINGS, boot_id=2)
    shell = ProcessShell(
        Runner(twin, LateLaser(0), network.attach("r1", twin=True), tmp_path), SharedClock(time_ns, speed=1000.0)
    )

    def stop() -> bool:
        live()
        return time_ns.value > 60 * S

    shell.run(stop)
    assert time_ns.value < 30 * S
    assert not older.node.must_stop


def test_where_mission_time_waits_for_robots_none_gives_particles_up(tmp_path: Path) -> None:
    agent, body = Agent("r1", SETTINGS), LateLaser(40)
    clock = SharedClock(SimpleNamespace(value=10 * S))
    ProcessShell(Runner(agent, body, MemoryNetwork().attach("r1"), tmp_path), clock).run(lambda: not body.left)
    assert agent.mapper.particles_most == 16


def test_a_new_map_of_a_robot_that_is_late_has_fewer_particles_soon_too(tmp_path: Path) -> None:
    agent, body = Agent("r1", SETTINGS), LateLaser(80)
    clock = WallClock(start_ns=time.monotonic_ns() - 10 * S)
    first = agent.mapper

    def stop() -> bool:
        if first.particles_most < 16 and agent.mapper is first:
            agent.mapper = Mapper(SETTINGS.rbpf, seed=1)
        return not body.left or agent.mapper.particles_most < 16

    ProcessShell(Runner(agent, body, MemoryNetwork().attach("r1"), tmp_path), clock).run(stop)
    assert agent.mapper is not first and agent.mapper.particles_most == 8


def test_a_shell_saves_reports_and_leaves_its_files_by_itself(tmp_path: Path) -> None:
    agent = Agent("r1", SETTINGS)
    keeper = Keeper(tmp_path / "state", 0.1, Inline())
    body = LateLaser(5)
    runner = Runner(agent, body, MemoryNetwork().attach("r1"), tmp_path / "out", keeper=keeper)
    end_s = time.monotonic() + DEADLINE_S

    def stop() -> bool:
        is_sent = all(runner.sent_bytes[lane] for lane in ("beacon", "status"))
        return (is_sent and keeper.saved_ns is not None and not body.left) or time.monotonic() > end_s

    ProcessShell(runner, WallClock()).run(stop)
    assert time.monotonic() < end_s
    assert runner.sent_bytes["control"]  # the goodbye
    assert json.loads((tmp_path / "out" / "robot.json").read_text())["scans"] == 5
