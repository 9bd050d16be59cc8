"""`mrslam save`: what is written, what is replaced, and what is said of maps that do not fit."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import read_saved_maps
from mrslam.sim_driver.cli.maps.merge import merge_files
from mrslam.sim_driver.cli.maps.save import SaveOptions, save_maps
from mrslam.spatial import InputError, OccupancyGrid, read_map, write_map
from mrslam.spatial.files.saved_map import read_saved_map
from tests.merge.joint.blocks import drive
from tests.sim_driver.test_merge_command import robot_folder


def save(*maps: Path, out: Path, as_json: bool = False) -> None:
    save_maps(SaveOptions(maps=maps, out=out, as_json=as_json))


def said(*maps: Path, out: Path) -> str:
    with pytest.raises(InputError) as caught:
        save(*maps, out=out)
    return str(caught.value)


def test_a_session_becomes_one_file_and_a_folder_again(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    robot_folder(tmp_path / "monday", drive(0.0, 60.0, seed=1))
    save(tmp_path / "monday", out=tmp_path / "office.mrslam")
    told = capsys.readouterr().err.replace("\n", " ")
    assert "1 session" in told and "of 120 keyframes" in told and "kB" in told
    save(tmp_path / "office.mrslam", out=tmp_path / "again")
    for name in ("map.pgm", "map.yaml"):
        assert (tmp_path / "again" / name).read_bytes() == (tmp_path / "monday" / name).read_bytes()
    assert (tmp_path / "again" / "map.png").exists()
    (one,) = read_saved_maps(tmp_path / "office.mrslam").values()
    (other,) = read_saved_maps(tmp_path / "again").values()
    assert one.epoch == other.epoch and 40 <= len(one.trail) == len(other.trail) < 120


def test_the_next_version_replaces_the_first_and_merge_reads_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    office = tmp_path / "office.mrslam"
    robot_folder(tmp_path / "monday", drive(0.0, 55.0, seed=1))
    robot_folder(tmp_path / "tuesday", drive(30.0, 80.0, 0.0007, seed=2))
    save(tmp_path / "monday", out=office)
    capsys.readouterr()
    given = len(read_saved_map(office).scans) + 160
    save(office, tmp_path / "tuesday", out=office, as_json=True)
    row = json.loads(capsys.readouterr().out)
    assert row["version"] == 2 and row["left_out"] == {} and row["keyframes"] < row["keyframes_given"] == given
    held = read_saved_map(office)
    assert [one.name for one in held.sessions] == ["map@monday", "map@tuesday"]
    assert held.grid.known_area_m2() > 1.02 * read_map(tmp_path / "monday" / "map.yaml").known_area_m2()
    merge_files([tmp_path / "monday", office], tmp_path / "out", None, "auto", None, [], False)
    assert "office is bent by up to" in capsys.readouterr().err.replace("\n", " ")


def test_sessions_whose_folders_have_one_name_are_both_saved(tmp_path: Path) -> None:
    robot_folder(tmp_path / "one" / "monday", drive(0.0, 55.0, seed=1))
    robot_folder(tmp_path / "two" / "monday", drive(30.0, 80.0, seed=2))
    save(tmp_path / "one" / "monday", tmp_path / "two" / "monday", out=tmp_path / "office.mrslam")
    assert read_saved_map(tmp_path / "office.mrslam").version == 2


def test_what_fits_nowhere_leaves_the_saved_map_as_it_is(tmp_path: Path) -> None:
    robot_folder(tmp_path / "monday", drive(0.0, 60.0, seed=1))
    cells = np.full((200, 200), 0, dtype=np.int8)
    cells[0] = 100
    (tmp_path / "other").mkdir()
    write_map(tmp_path / "other" / "map.yaml", OccupancyGrid(cells, 0.05))
    save(tmp_path / "monday", out=tmp_path / "office.mrslam")
    before = (tmp_path / "office.mrslam").read_bytes()
    words = said(tmp_path / "office.mrslam", tmp_path / "other", out=tmp_path / "office.mrslam")
    assert f"not written, for nothing fits {tmp_path / 'office.mrslam'}: {tmp_path / 'other'}" in words
    assert (tmp_path / "office.mrslam").read_bytes() == before


def test_no_other_map_is_replaced_and_targets_are_named(tmp_path: Path) -> None:
    robot_folder(tmp_path / "monday", drive(0.0, 20.0, seed=1))
    robot_folder(tmp_path / "tuesday", drive(0.0, 20.0, seed=1))
    save(tmp_path / "monday", out=tmp_path / "office.mrslam")
    words = said(tmp_path / "tuesday", tmp_path / "office.mrslam", out=tmp_path / "office.mrslam")
    assert "office.mrslam: would be replaced" in words
    assert "map.yaml: would be replaced" in said(tmp_path / "monday", out=tmp_path / "monday")
    assert "name a saved map" in said(tmp_path / "monday", out=tmp_path / "office.zip")
    assert "given twice" in said(tmp_path / "monday", tmp_path / "monday", out=tmp_path / "x.mrslam")
