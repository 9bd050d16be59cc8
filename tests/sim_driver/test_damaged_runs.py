"""Every file of a run, damaged in every way, for every command that reads one: one line that says so, or no harm."""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Callable
from contextlib import redirect_stderr, redirect_stdout
from pathlib import Path

import pytest

from mrslam.sim_driver.cli import console
from mrslam.sim_driver.cli.runs import bag, eval, gather, report
from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.missions.run_files import SCANS_FILE
from mrslam.sim_driver.replay import read_recording
from mrslam.sim_driver.replay.again import replay_mission
from mrslam.sim_driver.run.run import check_files
from mrslam.sim_driver.view.files import recordings
from mrslam.spatial import InputError
from tests.sim_driver.damage import DAMAGE, Case, cases, make_run


def _replay(folder: Path) -> None:
    """Do what ``run --from`` does before it starts."""
    mission = replay_mission(folder / "run")
    check_files(mission)
    for robot in mission.robots:
        assert mission.replay is not None
        read_recording(mission.replay / robot.id / SCANS_FILE)


COMMANDS: dict[str, Callable[[Path], object]] = {
    "eval": lambda folder: eval.eval_run(folder / "run", None, [], None, True),
    "report": lambda folder: report.report_run(folder / "run", None),
    "bag": lambda folder: bag.bag_run(folder / "run", folder / "run.mcap"),
    "view": lambda folder: recordings(folder / "run"),
    "run --from": _replay,
    "gather": lambda folder: gather.gather_agents([folder / "agents"], folder / "gathered", True),
}


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return make_run(tmp_path_factory.mktemp("whole"))


def said_by(command: str, folder: Path) -> str:
    """Run a command; return what it printed, and its error as the command line prints it."""
    out = io.StringIO()
    with warnings.catch_warnings(), redirect_stdout(out), redirect_stderr(out):
        warnings.simplefilter("error")
        console.console.file = out
        try:
            COMMANDS[command](folder)
        except (InputError, OSError) as error:
            print(f"mrslam: {error}", file=out)
        finally:
            console.console.file = None  # type: ignore[assignment]  # standard error, whatever it is then
    return out.getvalue()


SHARES = {"eval": 11, "report": 37, "bag": 13, "view": 5, "run --from": 5, "gather": 7}
"""One case in so many is tried here, others on every file; ``bench/damaged_runs.py`` tries all."""
FILES = {
    "config.json", "links.csv", "metrics.json", "r1/events.jsonl", "r1/keyframes.npz", "r1/map.pgm", "r1/map.yaml",
    "r1/robot.json", "r1/scans.npz", "r1/team_map.pgm", "r1/team_map.png", "r1/team_map.yaml", "r1/trajectory.tum",
    "r1/truth.tum", "run.rrd",
}  # fmt: skip


def test_every_file_of_a_run_is_damaged_in_more_than_ten_ways(whole: Path) -> None:
    files = {case.file for case in cases(whole, "run")}
    assert files == {f"run/{name}" for name in FILES}
    assert len(DAMAGE) > 20


@pytest.mark.parametrize("command", COMMANDS)
def test_every_kind_of_damage_is_one_line_or_does_no_harm(command: str, whole: Path, tmp_path: Path) -> None:
    chosen = list(cases(whole, "agents" if command == "gather" else "run"))[:: SHARES[command]]
    assert {case.damage for case in chosen} == set(DAMAGE) or command == "report"
    for i, case in enumerate(chosen):
        said = said_by(command, case.prepare(whole, tmp_path / str(i)))
        errors = [line for line in said.splitlines() if line.startswith("mrslam: ")]
        assert len(errors) <= 1, (case, said)
        assert "Traceback" not in said, (case, said)


def damaged(whole: Path, copy: Path, file: str, damage: str = "half") -> Path:
    return Case(file, damage).prepare(whole, copy)


@pytest.mark.parametrize("damage", ["empty", "half", "another type", "nan", "binary", "a folder", "deep", "huge"])
@pytest.mark.parametrize(
    ("command", "file"),
    [
        ("eval", "run/config.json"),
        ("report", "run/config.json"),
        ("run --from", "run/config.json"),
        ("run --from", "run/metrics.json"),
        ("run --from", "run/r1/scans.npz"),
        ("gather", "agents/r1/agent.json"),
    ],
)
def test_what_nothing_can_be_done_without_is_named(
    command: str, file: str, damage: str, whole: Path, tmp_path: Path
) -> None:
    said = said_by(command, damaged(whole, tmp_path / "copy", file, damage))
    assert said.startswith("mrslam: ") and said.count("\n") == 1
    assert file.rpartition("/")[2] in said or str(tmp_path / "copy" / file) in said


def test_a_damaged_robot_is_lost_and_the_other_is_judged(whole: Path, tmp_path: Path) -> None:
    found = assess(damaged(whole, tmp_path / "copy", "run/r1/robot.json") / "run")
    assert [line.partition(":")[0].rpartition("copy/")[2] for line in found["damaged"]] == ["run/r1/robot.json"]
    assert "r1: was lost in the run" in found["not_judged"]
    assert found["robots"].keys() == {"r2"} and found["robots"]["r2"]["trajectory"]["poses"] > 50


def test_damaged_metrics_are_made_of_the_robots_files(whole: Path, tmp_path: Path) -> None:
    before, after = assess(whole / "run"), assess(damaged(whole, tmp_path / "copy", "run/metrics.json") / "run")
    assert len(after["damaged"]) == 1 and "metrics.json" in after["damaged"][0]
    assert after["pairs"] == before["pairs"] and after["mission"]["bytes"] == before["mission"]["bytes"]
    assert after["mission"]["mission_s"] == pytest.approx(before["mission"]["mission_s"], abs=1.0)


@pytest.mark.parametrize("file", ["map.pgm", "map.yaml", "team_map.pgm", "trajectory.tum", "truth.tum", "events.jsonl"])
def test_one_damaged_file_costs_what_it_holds_and_no_more(file: str, whole: Path, tmp_path: Path) -> None:
    copy = damaged(whole, tmp_path / "copy", f"run/r1/{file}", "binary")
    found = assess(copy / "run")
    assert any(file.partition(".")[0] in line for line in found["damaged"])
    assert found["robots"]["r2"]["trajectory"] == assess(whole / "run")["robots"]["r2"]["trajectory"]
    own = found["robots"]["r1"]
    assert (own["trajectory"] is None) == (file in ("trajectory.tum", "truth.tum"))
    assert (own["map"] is None) == (file in ("team_map.pgm", "truth.tum"))
    report.report_run(copy / "run", None)
    assert "Not used: " in (copy / "run" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize("damage", ["empty", "half", "a folder", "another type"])
def test_a_damaged_recording_costs_the_report_no_more_than_when_places_were_seen(
    damage: str, whole: Path, tmp_path: Path
) -> None:
    copy = damaged(whole, tmp_path / "copy", "run/r1/scans.npz", damage)
    report.report_run(copy / "run", None)
    page = (copy / "run" / "report.html").read_text(encoding="utf-8")
    assert page.count("Not used: ") == 1 and "scans.npz" in page


def test_a_recording_is_made_of_what_is_whole(whole: Path, tmp_path: Path) -> None:
    copy = damaged(whole, tmp_path / "copy", "run/r1/map.pgm")
    said = said_by("bag", copy)
    assert "map.pgm" in said and "2 robots" in said


def test_gathering_takes_what_is_whole(whole: Path, tmp_path: Path) -> None:
    copy = damaged(whole, tmp_path / "copy", "agents/r1/robot.json")
    said = said_by("gather", copy)
    assert "of r1 there are only its events" in said
    assert json.loads((copy / "gathered" / "metrics.json").read_text())["robots_lost"] == ["r1"]


def test_lines_of_events_that_a_crash_cut_off_are_no_damage(whole: Path, tmp_path: Path) -> None:
    assert assess(damaged(whole, tmp_path / "copy", "run/r1/events.jsonl", "without its end") / "run")["damaged"] == []
