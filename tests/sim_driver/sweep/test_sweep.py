"""Sweeps: the plan, what they teach, and that stopping, processes or a cluster change nothing of the table."""

from __future__ import annotations

import csv
import io
import json
import zipfile
from concurrent.futures import Future
from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.sweep import make_plan, parse_knob, run_sweep
from mrslam.sim_driver.sweep.advice import Summary, advice, pareto, recommend, summarise
from mrslam.sim_driver.sweep.plots import draw_all
from mrslam.sim_driver.sweep.sweep import point_file, steps
from mrslam.sim_driver.sweep.table import write_table
from mrslam.sim_driver.sweep.work import Job, outcome_row, record_drive
from mrslam.sim_driver.sweep.workers import DaskWorkers, LocalWorkers
from mrslam.spatial import InputError, OccupancyGrid, write_map
from mrslam.spatial.files.images import write_image

MISSION = """
[mission]
seed = 2
duration_s = 14.0
[world]
name = "arena2"
[[robots]]
id = "r1"
[[robots]]
id = "r2"
[rbpf]
particles = 4
[comms]
beacon_window = 8
[sweep]
vary = ["comms.link_threshold=0.5,0.9", "comms.exchange_timeout_s=3,9"]
seeds = 1
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "small.toml"
    path.write_text(MISSION)
    return path


class Here:
    """Workers that are this process; they can be told to die after so many jobs."""

    def __init__(self, dies_after: int = 1_000) -> None:
        self.left, self.calls = dies_after, []

    def submit(self, function, *args):
        future: Future = Future()
        future.job = (function, args)  # type: ignore[attr-defined]
        return future

    def share(self, value):
        return value

    def next_done(self, pending):
        if self.left == 0:
            raise KeyboardInterrupt
        self.left -= 1
        future = min(pending, key=lambda one: (one.job[1][0].seed, one.job[1][0].assignments))
        function, args = future.job
        self.calls.append(function.__name__)
        try:
            future.set_result(function(*args))
        except ValueError as error:
            future.set_exception(error)
        return {future}


def recorded(job):
    return b"a drive"


def finished(job, drive):
    return {"bytes_exchanged": 5.0}


def sweep(plan, out, workers):
    count = []
    rows = run_sweep(plan, out, workers, lambda: count.append(1), print)
    assert len(count) == steps(plan)
    write_table(rows, out)
    return rows


def test_the_plan_is_every_combination_with_every_seed(path: Path) -> None:
    plan = make_plan(
        path, [parse_knob("comms.link_threshold=0.2,0.8"), parse_knob("agent.align_growth=0.1,0.2,0.3")], 4
    )
    assert len(plan.points) == 2 * 3 * 4 and len({point.name for point in plan.points}) == 24
    assert plan.recorded and plan.seeds == (2, 3, 4, 5)
    assert plan.points[0].assignments == ("comms.link_threshold=0.2", "agent.align_growth=0.1")
    from_file = make_plan(path)
    assert [knob.key for knob in from_file.knobs] == ["comms.link_threshold", "comms.exchange_timeout_s"]
    assert len(from_file.points) == 4
    assert not make_plan(path, [parse_knob("radio.power_dbm=5,10")], 1).recorded


def test_mistakes_are_named_before_anything_runs(path: Path) -> None:
    with pytest.raises(InputError, match=r"comms\.link_threshold must be in 0\.\.1"):
        make_plan(path, [parse_knob("comms.link_threshold=0.2,1.8")], 1)
    with pytest.raises(InputError, match=r"^--vary: comms: .*did you mean 'link_threshold'"):
        make_plan(path, [parse_knob("comms.link_treshold=0.2")], 1)
    with pytest.raises(InputError, match=r"^--set: unknown key 'cmms'"):
        make_plan(path, assignments=["cmms.link_threshold=0.2"])
    with pytest.raises(InputError, match="radio changes where robots drive"):
        make_plan(path, [parse_knob("radio.power_dbm=5")], 1, drive="recorded")
    with pytest.raises(InputError, match=r"mission\.seed is not varied: .* --seeds"):
        make_plan(path, [parse_knob("mission.seed=1,2")], 1)
    with pytest.raises(InputError, match="twice"):
        parse_knob("comms.link_threshold=0.2,0.2")
    assert parse_knob('a.b=[1,2],"x,y",3').values == ("[1,2]", '"x,y"', "3")


@pytest.mark.parametrize(
    ("world", "file"),
    [("arena2", "t.csv"), ("plan.png", "plan.png"), ("plan.yaml", "plan.yaml"), ("plan.yaml", "plan.pgm")],
)
def test_other_contents_of_a_file_that_the_mission_reads_are_another_sweep(path: Path, world: str, file: str) -> None:
    links = '[links]\ntrace = "t.csv"\n[comms]'
    path.write_text(MISSION.replace('"arena2"', f'"{world}"').replace("[comms]", links))
    cells = np.zeros((60, 80), dtype=np.int8)
    (path.parent / "t.csv").write_text("0,r1,r2,0.5\n")
    write_image(path.parent / "plan.png", cells.view(np.uint8))
    write_map(path.parent / "plan.yaml", OccupancyGrid(cells, 0.05))
    before, again = make_plan(path), make_plan(path)
    assert before.points == again.points and before.drive_name(2) == again.drive_name(2)
    changed = path.parent / file
    raw = changed.read_bytes()
    changed.write_bytes(raw + b"\n" if changed.suffix != ".pgm" else raw[:-1] + b"\x00")
    after = make_plan(path)
    assert not {point.name for point in before.points} & {point.name for point in after.points}
    assert before.drive_name(2) != after.drive_name(2)


@pytest.mark.parametrize("damage", ["", "[]", '{"seed": 2}', '{"bytes_exchanged": 5', "[" * 100_000])
def test_a_point_whose_file_is_damaged_is_run_again(path: Path, tmp_path: Path, monkeypatch, damage: str) -> None:
    monkeypatch.setattr("mrslam.sim_driver.sweep.sweep.record_drive", recorded)
    monkeypatch.setattr("mrslam.sim_driver.sweep.sweep.run_point", finished)
    plan = make_plan(path, [parse_knob("comms.link_threshold=0.5")], 1)
    (whole,) = run_sweep(plan, tmp_path / "out", Here(), lambda: None, print)
    point_file(tmp_path / "out", plan.points[0]).write_text(damage)
    again, idle = Here(), Here()
    assert run_sweep(plan, tmp_path / "out", again, lambda: None, print) == [whole]
    run_sweep(plan, tmp_path / "out", idle, lambda: None, print)
    assert (again.calls, idle.calls) == (["finished"], [])


def test_a_sweep_that_was_killed_goes_on_and_ends_with_the_same_table(path: Path, tmp_path: Path) -> None:
    plan = make_plan(path)
    whole = Here()
    rows = sweep(plan, tmp_path / "whole", whole)
    assert whole.calls == ["record_drive", *["run_point"] * 4]
    assert {row["comms.link_threshold"] for row in rows} == {"0.5", "0.9"}
    assert rows[0]["exchanges_done"] > rows[1]["exchanges_done"] >= 1  # the timeout tells
    killed = Here(dies_after=3)
    with pytest.raises(KeyboardInterrupt):
        sweep(plan, tmp_path / "killed", killed)
    rest = Here()
    sweep(plan, tmp_path / "killed", rest)
    assert rest.calls == ["run_point"] * 2
    assert (tmp_path / "killed" / "sweep.csv").read_bytes() == (tmp_path / "whole" / "sweep.csv").read_bytes()
    with (tmp_path / "whole" / "sweep.csv").open() as file:
        assert len(list(csv.DictReader(file))) == 4


def test_a_point_that_fails_is_said_and_tried_again(path: Path, tmp_path: Path, monkeypatch, capsys) -> None:
    plan = make_plan(path)
    real = sweep(plan, tmp_path / "real", Here())

    def broken(job, drive):
        if job.assignments[0].endswith("0.9"):
            raise ValueError("out of luck")
        return json.loads((tmp_path / "real" / "points" / f"{plan.points[0].name}.json").read_text())

    monkeypatch.setattr("mrslam.sim_driver.sweep.sweep.run_point", broken)
    assert len(sweep(plan, tmp_path / "out", Here())) == 2
    assert (
        "comms.link_threshold=0.9, comms.exchange_timeout_s=3, seed 2 failed: ValueError: out of luck"
        in capsys.readouterr().out
    )
    assert len(list((tmp_path / "out" / "points").iterdir())) == 2 < len(real)


@pytest.mark.slow
def test_processes_and_a_dask_cluster_give_the_same_table(path: Path, tmp_path: Path) -> None:
    distributed = pytest.importorskip("distributed")
    plan = make_plan(path)
    local = LocalWorkers(1)
    try:
        sweep(plan, tmp_path / "local", local)
    finally:
        local.close()
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, host="127.0.0.1"
    ) as cluster:
        dask = DaskWorkers(cluster.scheduler_address)
        try:
            sweep(plan, tmp_path / "dask", dask)
        finally:
            dask.close()
    assert (tmp_path / "dask" / "sweep.csv").read_bytes() == (tmp_path / "local" / "sweep.csv").read_bytes()


def test_a_scheduler_that_is_not_there_is_an_error() -> None:
    pytest.importorskip("distributed")
    with pytest.raises(InputError, match="no Dask scheduler answers"):
        DaskWorkers("tcp://127.0.0.1:9")


def one(settings: str, merge_s: float, kilobytes: float, false: int = 0, missed: int = 0) -> Summary:
    return Summary((settings,), 5, merge_s, kilobytes, false, missed, 0.9, 0.05)


def test_the_front_holds_what_nothing_beats() -> None:
    some = [one("a", 10, 100), one("b", 20, 50), one("c", 30, 60), one("d", float("inf"), 1), one("e", 10, 100)]
    assert [s.settings[0] for s in pareto(some)] == ["b", "a", "e"]


def test_the_recommendation_is_safe_first_then_quick_then_cheap() -> None:
    some = [one("wrong", 5, 10, false=1), one("misses", 5, 10, missed=1), one("fast", 10, 100), one("nearly", 10.9, 40)]
    some += [one("slow", 40, 5)]
    best = recommend(some)
    assert best is not None and best.settings == ("nearly",)
    text = advice(some, (parse_knob("comms.x=1"),))
    assert "Take comms.x=nearly" in text and "no false merge" in text and "40 kB" in text and "100 kB" in text
    assert "No setting" in advice([one("never", float("inf"), 1)], (parse_knob("comms.x=1"),))


def test_plots_show_runs_that_never_merged_and_settings_without_truth(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    knobs = parse_knob("comms.a=1,2"), parse_knob("comms.b=x,y")
    base = dict.fromkeys(("coverage_worst", "error_m", "first_correct_merge_s", "first_merge_s"))
    counts = {"bytes_exchanged": 1000.0, "false_merges": 0, "missed_merges": 1, "wrong_on_the_way": 0}
    rows = [{"comms.a": a, "comms.b": b, "seed": 1, **base, **counts} for a in "12" for b in "xy"]
    rows[0]["first_merge_s"] = 12.0
    summaries = summarise(rows, knobs)
    assert [s.merge_s for s in summaries] == [12.0, *[float("inf")] * 3]
    told = advice(summaries, knobs)
    assert "the first merge after 12 s" in told and "Whether merges were right is not known" in told
    assert "right merge" not in told and "false" not in told
    for picture in draw_all(rows, summaries, knobs, tmp_path):
        assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_sweep_records_what_it_drives_whatever_the_mission_says(path: Path) -> None:
    path.write_text(MISSION.replace("duration_s = 14.0", "duration_s = 3.0\nrecord = false"))
    plan = make_plan(path, [], 1)
    drive = record_drive(Job(str(path), dict(plan.tables), (), 2))
    with zipfile.ZipFile(io.BytesIO(drive)) as archive:
        assert {"r1/scans.npz", "r2/scans.npz"} <= set(archive.namelist())


def test_an_exchange_that_both_ends_completed_counts_once() -> None:
    numbers = ("first_merge_s", "first_correct_merge_s", "coverage_best", "coverage_worst", "correct_merges")
    more = ("false_merges", "wrong_merges_on_the_way", "missed_merges", "alignments_tried", "mission_s")
    mission = dict.fromkeys((*numbers, *more), 0) | {
        "bytes": {"exchanges": 900},
        "exchanges": {"opened": 4, "done": 6, "failed": 1},
    }
    row = outcome_row({"mission": mission, "pairs": [], "robots": {}}, {})
    assert (row["exchanges_done"], row["exchanges_failed"]) == (3, 1)
