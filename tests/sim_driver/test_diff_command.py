"""`mrslam diff`: the table, the picture, and what is said of maps that cannot be compared."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mrslam.merge.sessions.changes import Changes
from mrslam.merge.sessions.diff import Diff, Piece
from mrslam.sim_driver.cli.app import app
from mrslam.sim_driver.cli.maps.diff import DiffOptions, as_lines, diff_files
from mrslam.spatial import InputError, OccupancyGrid, write_map
from tests.merge.plans import building
from tests.merge.sessions.test_diff import with_boxes


def maps(folder: Path, *boxes: tuple[float, float, float, float]) -> Path:
    folder.mkdir(parents=True)
    write_map(folder / "map.yaml", with_boxes(building(), *boxes))
    return folder


def said(before: Path, after: Path, out: Path) -> str:
    with pytest.raises(InputError) as caught:
        diff_files(DiffOptions(before=before, after=after, out=out))
    return str(caught.value)


def test_the_table_and_the_picture(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    monday, tuesday = maps(tmp_path / "monday"), maps(tmp_path / "tuesday", (9.0, 3.5, 1.0, 0.5))
    diff_files(DiffOptions(before=monday, after=tuesday, out=tmp_path / "out"))
    told = capsys.readouterr().err
    assert "appeared      9.50    3.75   1.00 x 0.50    0.14" in told
    assert "1 appeared (0.14 m2), 0 vanished (0.00 m2), on the " in told
    assert (tmp_path / "out" / "diff.png").read_bytes()[:4] == b"\x89PNG"
    row = json.loads((tmp_path / "out" / "diff.json").read_text())
    assert row["appeared_m2"] == pytest.approx(0.14) and row["vanished_m2"] == 0 and len(row["pieces"]) == 1
    diff_files(DiffOptions(before=tuesday, after=monday, out=tmp_path / "out", same_frame=True, as_json=True))
    printed = json.loads(capsys.readouterr().out)
    assert printed["vanished_m2"] == pytest.approx(0.14) and printed["pieces"][0]["what"] == "vanished"


def test_maps_in_which_nothing_changed_say_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    monday, tuesday = maps(tmp_path / "monday"), maps(tmp_path / "tuesday")
    diff_files(DiffOptions(before=monday, after=tuesday, out=tmp_path / "out"))
    assert "nothing changed on the " in capsys.readouterr().err


def changed(before: Path, after: Path, out: Path, **options: float) -> float:
    """Return how many square metres appeared or vanished."""
    diff_files(DiffOptions(before=before, after=after, out=out, as_json=True, **options))  # type: ignore[arg-type]
    row = json.loads((out / "diff.json").read_text())
    return float(row["appeared_m2"] + row["vanished_m2"])


def test_what_counts_as_a_change_is_the_users_to_say(tmp_path: Path) -> None:
    monday, tuesday = maps(tmp_path / "monday"), maps(tmp_path / "tuesday", (9.0, 3.5, 1.0, 0.5))
    assert changed(monday, tuesday, tmp_path / "out") == pytest.approx(0.14)
    assert changed(monday, tuesday, tmp_path / "out", least_m2=0.2) == 0.0
    assert changed(monday, tuesday, tmp_path / "out", near_m=3.0) == 0.0


def test_the_command_takes_what_counts_as_a_change(tmp_path: Path) -> None:
    monday, tuesday = maps(tmp_path / "monday"), maps(tmp_path / "tuesday", (9.0, 3.5, 1.0, 0.5))
    moved = tmp_path / "moved"
    moved.mkdir()
    write_map(moved / "map.yaml", OccupancyGrid(building().cells, 0.05, (0.5, 0.0)))

    def found(after: Path, *options: str) -> float:
        command = ["diff", str(monday), str(after), "-o", str(tmp_path / "out"), "--json", *options]
        row = json.loads(CliRunner().invoke(app, command, catch_exceptions=False).stdout)
        return float(row["appeared_m2"] + row["vanished_m2"])

    assert found(tuesday, "--same-frame") == pytest.approx(0.14)
    assert found(tuesday, "--same-frame", "--least", "0.2") == 0.0
    apart = found(moved, "--same-frame")
    assert found(moved, "--same-frame", "--near", "0.6") < 0.1 * apart
    assert found(moved) == 0.0


def test_maps_of_one_frame_are_not_moved_onto_each_other(tmp_path: Path) -> None:
    monday = maps(tmp_path / "monday")
    (tmp_path / "moved").mkdir()
    write_map(tmp_path / "moved" / "map.yaml", OccupancyGrid(building().cells, 0.05, (0.5, 0.0)))
    assert changed(monday, tmp_path / "moved", tmp_path / "out") == 0.0
    assert changed(monday, tmp_path / "moved", tmp_path / "out", same_frame=True) > 1.0


@pytest.mark.parametrize(("count", "last"), [(12, None), (15, "and 3 smaller ones")])
def test_the_largest_pieces_are_listed_and_the_others_counted(count: int, last: str | None) -> None:
    grid = OccupancyGrid(np.zeros((4, 4), dtype=np.int8), 0.05)
    pieces = tuple(Piece("vanished", float(k), 0.0, 0.5, 0.5, 1.0) for k in range(count))
    nothing = np.zeros((4, 4), dtype=bool)
    lines = as_lines(Diff(grid, grid, Changes(nothing, nothing), pieces, 0.0))
    assert [float(line.split()[1]) for line in lines[1:13]] == list(range(12))
    assert lines[13:-1] == ([] if last is None else [last])
    assert lines[-1].startswith(f"0 appeared (0.00 m2), {count} vanished ({count:.2f} m2), on the ")


def test_maps_that_do_not_fit_and_runs_of_several_robots_are_named(tmp_path: Path) -> None:
    monday = maps(tmp_path / "monday")
    other = tmp_path / "other"
    other.mkdir()
    write_map(other / "map.yaml", building(9))
    words = said(monday, other, tmp_path / "out")
    assert f"{monday} and {other}: the maps do not fit: " in words and not (tmp_path / "out").exists()
    for robot in ("r1", "r2"):
        maps(tmp_path / "run" / robot)
    assert "run: holds 2 maps; name one of them" in said(tmp_path / "run", monday, tmp_path / "out")
    empty = tmp_path / "empty"
    empty.mkdir()
    write_map(empty / "map.yaml", OccupancyGrid(np.full((9, 9), -1, dtype=np.int8), 0.05))
    assert "shows 0.0 m2" in said(monday, empty, tmp_path / "out")
