"""A robot whose processor is too slow goes on with fewer particles, and with more again when it has air."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Agent, ProcessShell, Runner, Sensed, Settings, WallClock
from mrslam.agent.shells.overload import CALM_MOST_S, FLOOR, LATE_S, Overload
from mrslam.comms import MemoryNetwork
from mrslam.spatial import Scan

LASER_S = 0.1


def drive(load: Overload, cost_s: Callable[[float, int], float], until_s: float) -> list[tuple[float, int]]:
    """Map a laser's scans, two of which may wait, at a cost by time and particles; return when what was changed."""
    free_s, lost, changes = 0.0, 0, []
    for k in range(round(until_s / LASER_S)):
        taken_s = k * LASER_S
        if free_s - taken_s > 2 * LASER_S:  # a third would wait
            lost += 1
            continue
        free_s = max(free_s, taken_s) + cost_s(taken_s, load.count)
        count = load.look(free_s - taken_s, lost, free_s)
        if count is not None:
            assert count == load.count
            changes.append((free_s, count))
    return changes


def test_a_mapper_that_keeps_up_is_left_alone() -> None:
    assert drive(Overload(30), lambda t, n: 0.09, 600.0) == []


def test_a_hiccup_changes_nothing() -> None:
    assert drive(Overload(30), lambda t, n: 0.8 if int(t * 10) % 300 == 0 else 0.02, 600.0) == []


def test_particles_are_given_up_until_it_keeps_up_and_not_below_the_floor() -> None:
    load = Overload(32)
    drive(load, lambda t, n: 0.006 * n, 60.0)
    assert load.count == 16
    drowned = Overload(30)
    changes = drive(drowned, lambda t, n: 0.5, 60.0)
    assert [count for _, count in changes] == [15, FLOOR]
    assert drive(Overload(5), lambda t, n: 0.5, 60.0) == []


def test_particles_come_back_when_the_load_is_gone() -> None:
    load = Overload(30)
    changes = drive(load, lambda t, n: 0.5 if t < 60.0 else 0.01, 300.0)
    assert load.count == 30
    assert [count for _, count in changes] == [15, 8, 16, 30]


@pytest.mark.parametrize("particles", [16, 30])
def test_trying_more_becomes_rare_where_it_fails(particles: int) -> None:
    changes = drive(Overload(particles), lambda t, n: 0.5 if n == particles else 0.05, 7200.0)
    tries = [t for t, count in changes if count == particles]
    assert 3 <= len(tries) <= 15
    assert tries[-1] - tries[-2] > 5 * (tries[1] - tries[0])
    assert tries[-1] - tries[-2] < 1.2 * CALM_MOST_S


class LateBody:
    """A laser whose scans were all taken a second ago."""

    next_ns = None
    finished = False
    scans_lost = 0
    count = 0

    def sense(self, now_ns: int) -> Sensed | None:
        self.count += 1
        ranges = np.full(90, 3.0, dtype=np.float32)
        stamp_ns = now_ns - 1_000_000_000
        scan = Scan(stamp_ns=stamp_ns, ranges_m=ranges, angle_min_rad=-1.5, angle_increment_rad=0.03, range_max_m=10.0)
        return Sensed(stamp_ns, scan, np.zeros(3))

    def act(self, agent: Any, now_ns: int) -> None:
        """Nothing to drive."""


def test_the_mapper_of_a_robot_that_is_late_really_has_fewer_particles(tmp_path: Path) -> None:
    settings = Settings()
    agent = Agent("r1", replace(settings, rbpf=replace(settings.rbpf, particles=30, threads=1)))
    body = LateBody()
    runner = Runner(agent, body, MemoryNetwork().attach("r1"), tmp_path)
    shell = ProcessShell(runner, WallClock(start_ns=time.monotonic_ns() - 10_000_000_000))
    shell.run(lambda: agent.mapper.particles_most < 30 or body.count >= 200)
    assert agent.mapper.particles_most == 15
    events = [json.loads(line) for line in (tmp_path / "events.jsonl").read_text().splitlines()]
    told = [event for event in events if event["event"] == "overloaded"]
    assert [(event["particles"], event["of"]) for event in told] == [(15, 30)]
    assert told[0]["scan_age_s"] > LATE_S


def test_scans_that_are_lost_count_as_late_for_those_of_a_fast_laser_are_never_old() -> None:
    load = Overload(30)
    assert [load.look(0.05, 7, 0.025 * k) for k in range(400)] == [None] * 400  # all lost before, as at the start
    changes = [load.look(0.05, 8 + k, 10.0 + 0.025 * k) for k in range(100)]
    assert [count for count in changes if count is not None] == [15]


def test_after_a_reduction_only_new_late_scans_count() -> None:
    load = Overload(64)
    changed = [k for k in range(60) if load.look(1.0, 0, float(k)) is not None]  # of a laser that scans once a second
    assert len(changed) >= 3 and changed[1] - changed[0] == changed[2] - changed[1] >= changed[0] > 10
