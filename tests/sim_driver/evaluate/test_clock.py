"""What a robot notes by a clock that jumped is judged at the time it was."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.faults.clock import mission_times_s, shown_ns
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.spatial.files.tum import write_tum


def jump(at_s: float, amount: float) -> FaultConfig:
    return FaultConfig(kind="clock", robot="r1", at_s=at_s, amount=amount)


@given(st.lists(st.tuples(st.floats(1.0, 60.0), st.floats(-8.0, 20.0)), max_size=3))
def test_times_by_a_clock_that_jumped_are_known_again(jumps: list[tuple[float, float]]) -> None:
    faults = [jump(at_s, amount) for at_s, amount in sorted(jumps)]
    true_s = [k / 10 for k in range(1, 1000)]
    shown_s = [shown_ns(faults, round(t_s * 1e9)) / 1e9 for t_s in true_s]
    if len(jumps) <= 1:
        assert mission_times_s(faults, shown_s) == pytest.approx(true_s, abs=0.1001)
    assert mission_times_s([], shown_s) == shown_s


def test_of_several_jumps_the_last_is_undone_first() -> None:
    faults = [jump(20.0, 15.0), jump(40.0, 12.0)]
    true_s = [k / 10 for k in range(1, 1000)]
    shown_s = [shown_ns(faults, round(t_s * 1e9)) / 1e9 for t_s in true_s]
    assert shown_s[-1] > true_s[-1] + 27.0
    assert mission_times_s(faults, shown_s) == pytest.approx(true_s, abs=1e-6)


@pytest.mark.parametrize("amount", [20.0, -8.0])
def test_a_merge_before_a_new_map_is_not_one_of_it(tmp_path: Path, amount: float) -> None:
    """Robot r2 begins another map at 30 s; r1, whose clock jumped at 20 s, merges the old one at 28 s."""
    tables: dict[str, Any] = {
        "mission": {"shell": "virtual"},
        "world": {"name": "arena1"},
        "robots": [{"id": "r1"}, {"id": "r2"}],
        "faults": [{"kind": "clock", "robot": "r1", "at_s": 20.0, "amount": amount}],
    }
    merge = {"event": "merged", "a": "r1", "b": "r2", "T_a_b": [0.0, 0.0, 0.0], "confidence": 1.0}
    noted = {
        "r1": [{"t": 19.0, "event": "mapped"}, {"t": 28.008 + amount, **merge}],
        "r2": [{"t": 5.0, "event": "mapped"}, {"t": 29.0, "event": "given_up"}, {"t": 30.0, "event": "mapped"}],
    }
    for robot, events in noted.items():
        (tmp_path / robot).mkdir()
        lines = [json.dumps({"robot": robot, **event}) for event in events]
        (tmp_path / robot / "events.jsonl").write_text("\n".join(lines) + "\n")
    for name in ("trajectory", "truth"):
        write_tum(tmp_path / "r2" / f"{name}.tum", np.array([30_000_000_000]), np.zeros((1, 3)))
    run = RunResults.of(make_mission(tables, tmp_path / "clock.toml"), tmp_path)
    run.robots["r2"] = {}
    assert [event["t"] for event in run.events["r1"]] == pytest.approx([19.0, 28.0], abs=1e-3)
    assert run.events["r1"][1]["t"] < run.map_begun_s["r2"] == 30.0


@pytest.mark.parametrize(("amount", "is_noted"), [(20.0, True), (-8.0, True), (-40.0, True), (-40.0, False)])
def test_a_merge_by_a_clock_that_jumped_is_told_at_mission_time(tmp_path: Path, amount: float, is_noted: bool) -> None:
    """Robot r1, whose clock jumped at 20 s, merges at 28 s; a clock set far back shows times before the begin.

    Without a note of the merge it is at the begin.
    """
    tables: dict[str, Any] = {
        "mission": {"shell": "virtual"},
        "world": {"name": "arena1"},
        "robots": [{"id": "r1"}, {"id": "r2"}],
        "faults": [{"kind": "clock", "robot": "r1", "at_s": 20.0, "amount": amount}],
    }
    known = {"T_a_b": [0.0, 0.0, 0.0], "confidence": 1.0}
    pair = {"a": "r1", "b": "r2", "status": "accepted", "accepted_at_s": 28.008 + amount, "reason": "", **known}
    areas = {"known_area_m2": 1.0, "team_area_m2": 1.0}
    robot = {"id": "r1", "mode": "mapper", "placed": {}, "pairs": [pair], "links": [], **areas}
    merge = {"event": "merged", "a": "r1", "b": "r2", **known}
    lines = [
        json.dumps({"robot": "r1", **event})
        for event in ({"t": 19.0, "event": "mapped"}, {"t": 28.008 + amount, **merge})
    ]
    (tmp_path / "r1").mkdir()
    (tmp_path / "r1" / "robot.json").write_text(json.dumps(robot))
    (tmp_path / "r1" / "events.jsonl").write_text("\n".join(lines if is_noted else lines[:1]) + "\n")
    run = RunResults.of(make_mission(tables, tmp_path / "clock.toml"), tmp_path)
    assert run.damage == []
    told_s = run.robots["r1"]["pairs"][0]["accepted_at_s"]
    assert told_s == pytest.approx(28.0 if is_noted else 0.0, abs=1e-3)
