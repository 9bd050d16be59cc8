"""A saved map in one file: what is written is read, and every other file is refused in one line."""

from __future__ import annotations

import hashlib
import io
import json
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest

from mrslam.spatial import InputError, Keyframes, KeyScans, OccupancyGrid, read_map
from mrslam.spatial.files import saved_map
from mrslam.spatial.files.saved_map import SavedMap, Session, of_one_session, read_saved_map, write_saved_map
from tests.spatial.archives import manifest, repacked


def example() -> SavedMap:
    cells = np.full((40, 60), -1, dtype=np.int8)
    cells[5:30, 5:50], cells[5, 5:50] = 0, 100
    poses = np.array([[0.0, 0.0, 0.0], [0.5, 0.0, 0.1], [1.0, 0.2, 0.2]])
    scans = KeyScans.of_points([np.array([[2.0, 1.0], [1.0, 2.0]])] * 3, np.zeros((3, 2)))
    sessions = (Session("r1@monday", 2, 7.5), Session("r2@tuesday", 1, 3.0))
    return SavedMap(OccupancyGrid(cells, 0.05, (-1.0, 2.0)), Keyframes(np.arange(3) * 10**9, poses), scans, sessions)


@pytest.fixture
def file(tmp_path: Path) -> Path:
    path = tmp_path / "office.mrslam"
    write_saved_map(path, example())
    return path


def said(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_saved_map(path)
    assert "\n" not in str(caught.value) and str(caught.value).startswith(str(path))
    return str(caught.value)


def test_what_was_written_is_read(file: Path) -> None:
    saved, held = example(), read_saved_map(file)
    assert np.array_equal(held.grid.cells, saved.grid.cells) and held.grid.origin_m == saved.grid.origin_m
    assert held.sessions == saved.sessions and held.version == 2
    assert np.array_equal(held.keyframes.T_map_base, saved.keyframes.T_map_base)
    assert held.scans.equals(saved.scans)
    assert np.array_equal(read_map(file).cells, saved.grid.cells)  # as any map file


def test_the_same_map_is_the_same_bytes(file: Path) -> None:
    before = file.read_bytes()
    write_saved_map(file, read_saved_map(file))
    assert file.read_bytes() == before
    assert not list(file.parent.glob(".*.part"))


def test_any_program_finds_the_map_in_it(file: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(file) as archive:
        archive.extractall(tmp_path / "out")
    assert np.array_equal(read_map(tmp_path / "out" / "map.yaml").cells, example().grid.cells)


def test_a_file_cut_off_anywhere_is_refused(file: Path) -> None:
    whole = file.read_bytes()
    for length in (0, 3, 30, len(whole) // 2, len(whole) - 1):
        file.write_bytes(whole[:length])
        assert ("cut off or damaged" if length >= 4 else "not a saved map") in said(file)


def test_no_flipped_byte_goes_unnoticed(file: Path) -> None:
    whole = file.read_bytes()
    saved = example()
    for at in range(0, len(whole), 7):
        file.write_bytes(whole[:at] + bytes([whole[at] ^ 0x10]) + whole[at + 1 :])
        try:
            held = read_saved_map(file)
        except InputError as error:
            assert "\n" not in str(error)
        else:  # a byte that means nothing, as a zip's times and rights
            assert np.array_equal(held.grid.cells, saved.grid.cells) and held.sessions == saved.sessions
            assert np.array_equal(held.keyframes.T_map_base, saved.keyframes.T_map_base)
            assert held.scans.equals(saved.scans) and held.grid.origin_m == saved.grid.origin_m


def test_a_part_that_was_exchanged_is_named(file: Path) -> None:
    assert "map.pgm in it is not what was written" in said(repacked(file, {"map.pgm": b"P5 1 1 255 \xfe"}))


def test_a_part_larger_than_any_map_is_refused_before_it_is_unpacked(
    file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(saved_map, "PART_MOST_BYTES", 10_000)
    assert "map.pgm in it is larger than any map" in said(repacked(file, {"map.pgm": bytes(10_001)}))


def test_a_part_that_is_missing_is_named(file: Path) -> None:
    assert "keyframes.npz in it is not what was written" in said(repacked(file, {"keyframes.npz": None}))


def test_foreign_files_are_refused(file: Path, tmp_path: Path) -> None:
    other = tmp_path / "text.mrslam"
    other.write_text("a map, once")
    assert "not a saved map of mrslam" in said(other)
    raw = io.BytesIO()
    with zipfile.ZipFile(raw, "w") as archive:
        archive.writestr("readme", "hello")
    other.write_bytes(raw.getvalue())
    assert "there is no manifest.json in it" in said(other)
    assert "not a saved map of mrslam" in said(repacked(file, manifest(file, kind="photo album")))
    assert "cannot be read" in said(tmp_path / "nowhere.mrslam")


def test_a_file_of_a_newer_program_says_so(file: Path) -> None:
    words = "written by a newer mrslam (format 2, this one reads 1); update it"
    assert words in said(repacked(file, manifest(file, format=2)))


@pytest.mark.parametrize(
    "change",
    [{"format": "1"}, {"sha256": 3}, {"sessions": []}, {"sessions": [{"name": "a"}]}, {"resolution_m": -1.0},
     {"origin_m": [0.0]}, {"sessions": [{"name": "a", "keyframes": 9, "way_m": 1.0}]}],
)  # fmt: skip
def test_a_manifest_that_makes_no_sense_is_damage(change: dict[str, object], file: Path) -> None:
    assert "damaged" in said(repacked(file, manifest(file, **change)))


def test_a_session_knows_how_far_its_robot_drove() -> None:
    poses = np.array([[0.0, 0.0, 0.0], [3.0, 4.0, 1.0], [3.0, 4.0, 2.0], [3.0, 3.0, 2.0]])
    keyframes = Keyframes(np.arange(4), poses)
    saved = of_one_session("r1", OccupancyGrid(np.zeros((2, 2), np.int8), 0.05), keyframes, KeyScans.blank(4))
    (session,) = saved.sessions
    assert (session.keyframes, session.way_m) == (4, 6.0)


def test_a_map_of_no_session_or_of_no_format_is_refused(file: Path) -> None:
    with pytest.raises(InputError, match="0 sessions"):
        SavedMap(example().grid, Keyframes.empty(), KeyScans.empty(), ())
    assert "its format is 0" in said(repacked(file, manifest(file, format=0)))


def test_a_part_that_cannot_be_read_is_named_with_its_file(file: Path) -> None:
    rubbish = b"rubbish"
    with zipfile.ZipFile(file) as archive:
        hashes = json.loads(archive.read("manifest.json"))["sha256"]
    hashes["map.pgm"] = hashlib.sha256(rubbish).hexdigest()
    change = {**manifest(file, sha256=hashes), "map.pgm": rubbish}
    assert f"{file / 'map.pgm'}: not a readable image" in said(repacked(file, change))


def test_when_it_was_written_is_no_part_of_the_file(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    before = file.read_bytes()
    monkeypatch.setattr(time, "localtime", lambda *_: time.gmtime(1_000_000_000))
    monkeypatch.setattr(time, "time", lambda: 1_000_000_000.0)
    write_saved_map(file, example())
    assert file.read_bytes() == before
