"""Saved maps from disk: their names, their keyframes, and one clear line for every file that is of no use."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from mrslam.agent import read_saved_maps
from mrslam.spatial import InputError, Keyframes, KeyScans, OccupancyGrid, read_map, write_map
from mrslam.spatial.files.keyframes import read_scanned_keyframes, write_keyframes
from mrslam.spatial.files.saved_map import of_one_session, write_saved_map
from mrslam.spatial.key_scans import RANGE_M

STAMPS_NS = np.arange(10) * 1_000_000_000


def room() -> OccupancyGrid:
    cells = np.full((200, 200), -1, dtype=np.int8)
    cells[20:180, 20:180] = 0
    cells[[20, 179], 20:180] = cells[20:180, [20]] = cells[20:180, [179]] = 100
    return OccupancyGrid(cells, 0.05)


def saved(folder: Path, *, at_m: float = 4.0, y_m: float = 4.0, is_robot: bool = False) -> Path:
    """Save a map with keyframes along 2 m of its left wall."""
    folder.mkdir(parents=True)
    write_map(folder / "map.yaml", room())
    wall = np.array(
        [[0, round((at_m - 1.025) / RANGE_M)]], dtype=np.uint16
    )  # one point straight behind: the wall at x = 1
    scans = KeyScans(np.arange(11, dtype=np.int32), np.tile(wall, (10, 1)), np.zeros((10, 2), np.float32))
    places = np.stack([np.full(10, at_m), y_m + np.linspace(0.0, 2.0, 10), np.zeros(10)], axis=1)
    write_keyframes(folder / "keyframes.npz", Keyframes(STAMPS_NS, places), scans)
    if is_robot:
        (folder / "robot.json").write_text("{}")
    return folder


def test_a_saved_map_comes_with_its_keyframes(tmp_path: Path) -> None:
    ((name, known),) = read_saved_maps(saved(tmp_path / "office")).items()
    assert name == "map@office" and len(known.trail) == 10
    assert known.grid.known_area_m2() == pytest.approx(room().known_area_m2())


def test_a_team_map_has_nothing_of_the_keyframes_of_its_robots_own_map(tmp_path: Path) -> None:
    folder = saved(tmp_path / "office")
    write_map(folder / "team_map.yaml", room())
    ((name, known),) = read_saved_maps(folder / "team_map.yaml").items()
    assert name == "team_map@office" and not len(known.trail)


def test_a_run_is_a_saved_map_a_robot(tmp_path: Path) -> None:
    for robot in ("r1", "r2"):
        saved(tmp_path / "monday" / robot, is_robot=True)
    assert list(read_saved_maps(tmp_path / "monday")) == ["r1@monday", "r2@monday"]
    assert list(read_saved_maps(tmp_path / "monday" / "r2")) == ["r2@monday"]


@pytest.mark.parametrize(
    ("folder", "file", "name"),
    [
        ("office@2026-11-21", "map.yaml", "office@2026-11-21"),
        ("maps", "ground floor.yaml", "ground-floor@maps"),
        ("out", "team_map.yaml", "team_map@out"),
        (".hidden", "ü.yaml", "-@hidden"),
        ("f" * 80, "g" * 70 + ".yaml", "g" * 64 + "@" + "f" * 64),
    ],
)
def test_names(folder: str, file: str, name: str, tmp_path: Path) -> None:
    (tmp_path / folder).mkdir()
    write_map(tmp_path / folder / file, room())
    ((found, known),) = read_saved_maps(tmp_path / folder / file).items()
    assert found == name and len(known.trail) == 0


def test_the_same_map_has_the_same_epoch_and_another_another(tmp_path: Path) -> None:
    def epoch(name: str, **places: float) -> int:
        ((_, known),) = read_saved_maps(saved(tmp_path / name, **places)).items()
        return known.epoch

    first = epoch("first")
    assert first == epoch("same") >= 1
    assert first not in (epoch("scans", at_m=5.0), epoch("places", y_m=5.0))


def test_the_same_drawing_at_another_scale_is_another_map(tmp_path: Path) -> None:
    epochs = set()
    for name, resolution_m in (("fine", 0.05), ("coarse", 0.1)):
        write_map(tmp_path / f"{name}.yaml", OccupancyGrid(room().cells, resolution_m))
        ((_, known),) = read_saved_maps(tmp_path / f"{name}.yaml").items()
        epochs.add(known.epoch)
    assert len(epochs) == 2


def in_one_file(tmp_path: Path, name: str, **places: float) -> Path:
    folder = saved(tmp_path / "folder", **places)
    keyframes, scans = read_scanned_keyframes(folder / "keyframes.npz")
    path = tmp_path / name
    write_saved_map(path, of_one_session("r1@monday", read_map(folder / "map.yaml"), keyframes, scans))
    return path


@pytest.mark.parametrize(
    ("name", "expected"), [("maps/office.mrslam", "office@maps"), ("office@monday.mrslam", "office@monday")]
)
def test_a_saved_map_in_one_file_is_what_its_folder_is(name: str, expected: str, tmp_path: Path) -> None:
    ((found, known),) = read_saved_maps(in_one_file(tmp_path, name)).items()
    ((_, beside),) = read_saved_maps(tmp_path / "folder").items()
    assert found == expected and known.epoch == beside.epoch and len(known.trail) == 10


def test_keyframes_of_another_map_in_the_file_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"office\.mrslam: its keyframes are not of its map"):
        read_saved_maps(in_one_file(tmp_path, "office.mrslam", at_m=30.0))
    with pytest.raises(InputError, match="no such map file"):
        read_saved_maps(tmp_path / "nowhere.mrslam")


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def test_damaged_and_foreign_files_give_one_line_each(tmp_path: Path) -> None:
    def said(folder: Path) -> str:
        with pytest.raises(InputError) as caught:
            read_saved_maps(folder)
        assert "\n" not in str(caught.value) and str(tmp_path) in str(caught.value)
        return str(caught.value)

    assert "no such map file" in said(tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    assert "holds no map.yaml" in said(tmp_path / "empty")
    cut(saved(tmp_path / "image") / "map.pgm")
    said(tmp_path / "image")
    cut(saved(tmp_path / "keys") / "keyframes.npz")
    assert "keyframes.npz: not a readable .npz" in said(tmp_path / "keys")
    (saved(tmp_path / "text") / "map.yaml").write_text("a: [")
    assert "not a readable YAML file" in said(tmp_path / "text")
    (saved(tmp_path / "gone") / "map.pgm").unlink()
    assert "does not exist" in said(tmp_path / "gone")
    saved(tmp_path / "foreign", at_m=30.0)
    assert "keyframes.npz: is not of the map beside it" in said(tmp_path / "foreign")
    unknown = OccupancyGrid(np.full((9, 9), -1, dtype=np.int8), 0.05)
    write_map(saved(tmp_path / "unknown") / "map.yaml", unknown)
    assert "shows 0.0 m2" in said(tmp_path / "unknown")
    write_map(saved(tmp_path / "wallless") / "map.yaml", OccupancyGrid(np.zeros((90, 90), dtype=np.int8), 0.05))
    assert "shows no wall" in said(tmp_path / "wallless")
