"""A folder that is used again holds the new run and what a user put there, and nothing of the run before."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from mrslam.sim_driver.cli.runs.bag import bag_run
from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.missions.run_folder import robots_of
from mrslam.sim_driver.replay.again import replay_mission
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.run.earlier import clear_earlier
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.view.files import open_recording
from mrslam.spatial import InputError


def mission(name: str, *robots: str, **tables: object) -> Mission:
    team = {
        "mission": {"seed": 2, "duration_s": 3.0, "shell": "virtual"},
        "world": {"name": "arena2"},
        "robots": [{"id": robot} for robot in robots],
        "rbpf": {"particles": 3},
    }
    return make_mission({**team, **tables}, Path(f"{name}.toml"))


def run(one: Mission, out: Path) -> list[str]:
    said: list[str] = []
    run_mission(one, out, lambda mission_s, total_s, text: None, said.append)
    write_report(out)
    return [text for text in said if "earlier run" in text]


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def test_a_run_replaces_the_one_before_and_nothing_else(tmp_path: Path) -> None:
    out, new = tmp_path / "out", tmp_path / "new"
    assert run(mission("three", "r1", "r2", "r3"), out) == []
    bag_run(out, None)
    (out / "run.rrd").write_bytes(b"a recording")
    mine = {"notes.txt": b"mine", "r3/photo.png": b"mine", "maps/map.yaml": b"mine", "other.rrd": b"mine"}
    for name, content in mine.items():
        (out / name).parent.mkdir(exist_ok=True)
        (out / name).write_bytes(content)
    assert run(mission("two", "r1", "r2"), out) == [f"{out} held an earlier run of three: it is replaced"]
    run(mission("two", "r1", "r2"), new)
    assert files(out) == {**files(new), **mine}
    run(mission("one", "r2"), out)
    assert not (out / "r1").exists()


def test_readers_go_by_the_robots_of_the_run(tmp_path: Path) -> None:
    """Not by the folders: somebody may have copied another robot's there."""
    out = tmp_path / "out"
    run(mission("two", "r1", "r2"), out)
    (out / "r1").rename(out / "r9")
    run(mission("two", "r1", "r2"), out)
    assert robots_of(out) == ["r1", "r2"]
    assert set(assess(out)["robots"]) == {"r1", "r2"}
    write_report(out)
    bag_run(out, None)
    assert b"/r2/map" in (out / "run.mcap").read_bytes() and b"/r9/" not in (out / "run.mcap").read_bytes()
    (out / "r9" / "view.rrd").write_bytes(b"")
    with pytest.raises(InputError, match="holds no recording"):
        open_recording(out)


def test_what_the_new_run_reads_is_not_removed(tmp_path: Path) -> None:
    out = tmp_path / "out"
    run(mission("one", "r1", "r2"), out)
    before = files(out)
    trace = {"trace": str(out / "links.csv")}
    follows = [{"id": "r1", "driver": "trajectory", "trajectory": str(out / "r1" / "truth.tum")}]
    world = {"name": str(out / "r1" / "map.yaml")}
    for tables in ({"links": trace}, {"robots": follows}, {"world": world}):
        with pytest.raises(InputError, match=r"the mission reads this file of an earlier run.*name another folder"):
            clear_earlier(mission("two", "r1", **tables), out)
    run_mission(replay_mission(out), tmp_path / "again", lambda mission_s, total_s, text: None, print)
    with pytest.raises(InputError, match="the drive that is played again is kept there"):
        clear_earlier(replay_mission(tmp_path / "again"), out)
    assert files(out) == before


def test_a_run_that_cannot_begin_leaves_the_one_before_as_it_was(tmp_path: Path) -> None:
    out, log = tmp_path / "out", tmp_path / "cut.clf"
    run(mission("three", "r1", "r2", "r3"), out)
    (out / "r1" / "notes.txt").write_text("mine")
    before = files(out)
    log.write_text("FLASER 3 1.0 2.0")
    begins = mission("two", robots=[{"id": "r8"}, {"id": "r9", "log": str(log)}])  # r8 writes a file before r9 fails
    for new in (mission("two", "r1", world={"name": "offce"}), begins):
        (out / ".earlier" / "r9").mkdir(parents=True)  # of a run that was killed
        (out / ".earlier" / "r9" / "map.pgm").write_text("old")
        with pytest.raises(InputError, match=r"the earlier run in .* is as it was"):
            run(new, out)
        assert files(out) == before and {path.name for path in out.iterdir() if path.is_dir()} == {"r1", "r2", "r3"}


def test_what_fails_when_a_run_is_over_costs_no_files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(mission("three", "r1", "r2", "r3"), tmp_path)

    def unreadable(*told: object, **more: object) -> None:
        raise InputError("some.relations: line 3 has no eight numbers")

    monkeypatch.setattr("mrslam.sim_driver.run.run.write_metrics", unreadable)
    with pytest.raises(InputError, match=r"no eight numbers$"):
        run(mission("one", "r2"), tmp_path)
    assert robots_of(tmp_path) == ["r2"] and (tmp_path / "r2" / "map.pgm").exists()
    assert not (tmp_path / "r1").exists() and not (tmp_path / ".earlier").exists()


def test_an_agents_checkpoint_stays(tmp_path: Path) -> None:
    (tmp_path / "r1").mkdir()
    (tmp_path / "r1" / "checkpoint").write_bytes(b"all it knows")
    with pytest.raises(InputError, match="holds the checkpoint of an agent"):
        run(mission("two", "r1", "r2"), tmp_path)
    assert files(tmp_path) == {"r1/checkpoint": b"all it knows"}


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"robots": [{"id": "../mine"}]}', '{"robots": [{"id": 3}]}'])
def test_a_config_that_no_run_wrote_removes_nothing(tmp_path: Path, text: str) -> None:
    out = tmp_path / "out"
    for folder in (out, tmp_path / "mine"):
        folder.mkdir()
        (folder / "metrics.json").write_text("mine")
        (folder / "map.yaml").write_text("mine")
    (out / "config.json").write_text(text)
    before = files(tmp_path)
    assert robots_of(out) is None and clear_earlier(mission("two", "r1"), out) is None
    assert files(tmp_path) == before


def test_a_run_that_was_broken_off_is_replaced_too(tmp_path: Path) -> None:
    run(mission("three", "r1", "r3"), tmp_path)
    for left in ("metrics.json", "report.html"):
        (tmp_path / left).unlink()
    assert clear_earlier(mission("two", "r1"), tmp_path) == "three"
    assert files(tmp_path) == {} and not list(tmp_path.iterdir())
    (tmp_path / "config.json").write_text(json.dumps({"robots": [{"id": "r1"}]}))
    assert clear_earlier(mission("two", "r1"), tmp_path) == "a mission"


def test_a_folder_of_an_earlier_run_that_the_new_one_reads_is_not_emptied(tmp_path: Path) -> None:
    out, link = tmp_path / "out", tmp_path / "link"
    run(mission("one", "r1"), out)
    link.symlink_to(out)
    before = files(out)
    for reads, words in (
        (mission("two", "r1", maps=[{"path": str(out / "r1")}]), "the mission reads this file"),
        (replace(mission("two", "r1"), replay=link), "the drive that is played again is kept there"),
    ):
        with pytest.raises(InputError, match=words):
            clear_earlier(reads, out)
        assert files(out) == before
