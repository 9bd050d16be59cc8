"""``mrslam sweep``, called as a user does, on points that were run before: what it passes on, writes and says."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner, Result

from mrslam.sim_driver.cli.app import app
from mrslam.sim_driver.sweep import Plan, make_plan, parse_knob
from mrslam.sim_driver.sweep.sweep import point_file
from mrslam.spatial import InputError

MISSION = """
[mission]
seed = 5
duration_s = 1.0
[world]
name = "arena1"
[[robots]]
id = "r1"
"""
KNOB = "comms.link_threshold=0.2,0.8"
RUN = {
    "first_merge_s": 9.0, "first_correct_merge_s": 9.0, "coverage_best": 0.9, "coverage_worst": 0.5, "error_m": 0.1,
    "bytes_exchanged": 4000.0, "false_merges": 0, "missed_merges": 0, "wrong_on_the_way": 0, "mission_s": 60.0,
}  # fmt: skip


@pytest.fixture
def mission(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(MISSION)
    return path


@pytest.fixture
def idle(monkeypatch: pytest.MonkeyPatch) -> list[tuple[str | None, int]]:
    """Workers that have nothing to do, for all points were run before; returns where they were asked for."""
    asked: list[tuple[str | None, int]] = []

    class Idle:
        def submit(self, function: Callable[..., Any], *args: Any) -> Any:
            raise AssertionError(f"nothing is left to run, got {function.__name__}{args}")

    @contextmanager
    def workers_at(scheduler: str | None, count: int) -> Iterator[Idle]:
        asked.append((scheduler, count))
        yield Idle()

    monkeypatch.setattr("mrslam.sim_driver.cli.runs.sweep.workers_at", workers_at)
    return asked


def finish(plan: Plan, out: Path) -> None:
    """Leave a row of every point, as a sweep that ran has; the second setting is the cheaper one."""
    for point in plan.points:
        row = RUN | {"bytes_exchanged": 4000.0 - 1000.0 * plan.knobs[0].values.index(point.settings[0])}
        path = point_file(out, point)
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(json.dumps(row))


def sweep(mission: Path, *arguments: str) -> Result:
    return CliRunner().invoke(app, ["sweep", str(mission), "--out", str(mission.parent / "out"), *arguments])


def test_a_sweep_leaves_its_table_plots_and_advice_and_says_where(
    mission: Path, idle: list[tuple[str | None, int]]
) -> None:
    out = mission.parent / "out"
    finish(make_plan(mission, [parse_knob(KNOB)], 2, "anew", ["rbpf.particles=7"]), out)
    result = sweep(mission, "--vary", KNOB, "--seeds", "2", "--drive", "anew", "--set", "rbpf.particles=7")
    assert result.exit_code == 0, result.output
    with (out / "sweep.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [(row["comms.link_threshold"], row["seed"], row["bytes_exchanged"]) for row in rows] == [
        ("0.2", "5", "4000.0"), ("0.2", "6", "4000.0"), ("0.8", "5", "3000.0"), ("0.8", "6", "3000.0")
    ]  # fmt: skip
    advice = (out / "advice.txt").read_text()
    assert advice.startswith("Take comms.link_threshold=0.8: in 2 runs no false merge") and advice.endswith("\n")
    said = " ".join(result.stderr.split())
    assert "4 runs (2 seeds); every run drives anew" in said and advice.strip() in said
    assert "4 of 4 runs in" in said
    for name in {path.name for path in out.iterdir() if path.is_file()} - {"advice.txt"}:
        assert name in said, name
    assert result.stdout == ""


def test_a_script_gets_rows_advice_and_the_front_as_one_json_object(
    mission: Path, idle: list[tuple[str | None, int]]
) -> None:
    out = mission.parent / "out"
    finish(make_plan(mission, [parse_knob(KNOB)], 1), out)
    result = sweep(mission, "--vary", KNOB, "--seeds", "1", "--json", "--workers", "3")
    assert idle == [(None, 3)]
    told: dict[str, Any] = json.loads(result.stdout)
    assert told["advice"] == (out / "advice.txt").read_text().strip()
    assert [one["settings"] for one in told["pareto"]] == [["0.8"]]
    assert [row["comms.link_threshold"] for row in told["rows"]] == ["0.2", "0.8"]
    assert "each seed's drive is recorded once and replayed" in " ".join(result.stderr.split())


def test_a_sweep_none_of_whose_runs_succeeds_says_so(mission: Path) -> None:
    missing = '[[maps]]\npath = "nowhere.mrslam"\n'
    mission.write_text(MISSION + missing)
    result = sweep(mission, "--vary", KNOB, "--seeds", "1", "--workers", "1")
    assert isinstance(result.exception, InputError) and "no run of the sweep succeeded" in str(result.exception)
    said = " ".join(result.stderr.split())
    assert "the drive of seed 5 failed: " in said and "nowhere.mrslam" in said


def test_what_to_vary_is_needed(mission: Path) -> None:
    result = sweep(mission)
    assert isinstance(result.exception, InputError) and "something to vary" in str(result.exception)


def test_a_mission_that_cannot_begin_is_said_once_and_before_anything_runs(mission: Path) -> None:
    result = sweep(mission, "--vary", KNOB, "--set", "world.name=offce")
    assert isinstance(result.exception, InputError) and "no built-in world" in str(result.exception)
    assert result.output == ""


def test_a_sweep_that_is_broken_off_says_what_there_is(mission: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = make_plan(mission, [parse_knob(KNOB)], 2)
    finish(plan, mission.parent / "out")
    point_file(mission.parent / "out", plan.points[2]).unlink()

    @contextmanager
    def broken_off(scheduler: str | None, count: int) -> Iterator[Any]:
        raise KeyboardInterrupt
        yield

    monkeypatch.setattr("mrslam.sim_driver.cli.runs.sweep.workers_at", broken_off)
    said = " ".join(sweep(mission, "--vary", KNOB, "--seeds", "2").stderr.split())
    assert "3 of 4 runs are done; the same command does the rest" in said
