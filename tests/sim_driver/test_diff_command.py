"""`mrslam diff`: the table, the picture, and what is said of maps that cannot be compared."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from mrslam.sim_driver.cli.maps.diff import DiffOptions, diff_files
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
