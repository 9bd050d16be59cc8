"""What ``mrslam align`` prints of an answer, and which maps it takes from files that hold two."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from mrslam.alignment import Alignment, Evidence, Rejection, WallEvidence
from mrslam.sim_driver.cli.maps.align import align_files, as_row
from mrslam.spatial import InputError, OccupancyGrid, se2, write_map
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.trinary import pixels
from tests.merge.plans import building


def aligned(capsys: pytest.CaptureFixture[str], a: Path, b: Path | None) -> str:
    align_files(a, b, "auto", None, [], False)
    return capsys.readouterr().err.replace("\n", " ")


def test_an_answer_says_where_the_second_map_lies_in_the_first(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan = building()
    write_map(tmp_path / "a.yaml", plan)
    width_m = plan.shape[0] * plan.resolution_m  # a quarter of a turn about a's corner, and moved back into view
    write_map(tmp_path / "b.yaml", OccupancyGrid(np.ascontiguousarray(np.rot90(plan.cells, -1)), plan.resolution_m))
    T_a_b = se2.inverse(se2.transform(width_m, 0.0, 0.5 * np.pi))
    told = aligned(capsys, tmp_path / "a.yaml", tmp_path / "b.yaml")
    assert told.startswith("accepted: b lies in a at x ")
    words = told.split()
    x_m, y_m, turn_deg = (float(words[words.index(word) + 1]) for word in ("x", "y", "by"))
    assert (x_m, y_m) == pytest.approx(T_a_b[:2], abs=0.03) and turn_deg == pytest.approx(-90.0, abs=0.2)
    assert "bent by" not in told


@pytest.mark.parametrize("names", [("pair", None), ("pair", "pair"), ("a", "pair"), ("a", "b")])
def test_which_map_of_a_file_is_meant(
    names: tuple[str, str | None], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    plan, none = building(), (0.0, 0.0)
    b = {"origin": (3.0, -2.0), "cells": plan.cells}  # the same building in a frame of its own
    np.savez(tmp_path / "pair.npz", a=plan.cells, origin_a=none, b=b["cells"], origin_b=b["origin"], res=0.05)
    np.savez(tmp_path / "a.npz", a=plan.cells, origin_a=none, res=0.05)
    np.savez(tmp_path / "b.npz", a=b["cells"], origin_a=b["origin"], res=0.05)
    one, other = (None if name is None else tmp_path / f"{name}.npz" for name in names)
    assert one is not None
    assert "accepted: b lies in a at x -3.000 m, y 2.000 m, turned by " in aligned(capsys, one, other)


def test_a_folder_stands_for_its_only_map(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    for robot in ("r1", "r2"):
        (tmp_path / robot).mkdir()
        write_map(tmp_path / robot / "map.yaml", building())
    assert aligned(capsys, tmp_path / "r1", tmp_path / "r2" / "map.yaml").startswith("accepted")
    with pytest.raises(InputError, match=r"holds 2 maps; name one of them \(.*map.yaml\)"):
        align_files(tmp_path / "r1", tmp_path, "auto", None, [], False)


def test_bare_images_have_the_resolution_that_was_given(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    plan = building()
    for name, cells in (("a", plan.cells), ("b", plan.cells[:, 40:])):
        write_image(tmp_path / f"{name}.png", pixels(OccupancyGrid(cells, 0.05)))
    align_files(tmp_path / "a.png", tmp_path / "b.png", "auto", 0.1, [], False)
    told = capsys.readouterr().err.replace("\n", " ")
    found = re.search(r"^accepted: b lies in a at x (\S+) m", told)
    assert found is not None and float(found[1]) == pytest.approx(4.0, abs=0.05)


T, RIVAL, THIRD = np.array([1.0, 2.0, 0.5]), np.array([3.0, 4.0, -0.5]), np.zeros(3)
EVIDENCE = Evidence(a=WallEvidence(), b=WallEvidence())


def test_a_transform_is_printed_of_accepted_maps_alone_and_all_places_of_ambiguous_ones() -> None:
    accepted = as_row(Alignment(T, 0.9, EVIDENCE, np.eye(3), "auto"))
    rejected = as_row(Rejection("walls contradict", 0.4, EVIDENCE, "auto", T))
    ambiguous = as_row(Rejection("looks alike", 0.5, EVIDENCE, "auto", T, False, (RIVAL, THIRD)))
    nowhere = as_row(Rejection("nothing matches", 0.0, None, "auto"))
    assert [row["status"] for row in (accepted, rejected, ambiguous, nowhere)] == [
        "accepted", "rejected", "ambiguous", "rejected",
    ]  # fmt: skip
    assert [row["T_a_b"] for row in (accepted, rejected, ambiguous, nowhere)] == [T.tolist(), None, None, None]
    assert ambiguous["places"] == [T.tolist(), RIVAL.tolist(), THIRD.tolist()]
    assert accepted["places"] == rejected["places"] == nowhere["places"] == []
    assert [row["reason"] for row in (accepted, ambiguous)] == ["accepted", "looks alike"]
    assert nowhere["evidence"] == {} and json.dumps(accepted["evidence"], allow_nan=False) != "{}"


def test_an_ambiguous_answer_says_all_places(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    half = building(rooms=3).cells
    twice = np.maximum(half, half[::-1, ::-1])  # looks the same turned by half a turn
    write_map(tmp_path / "a.yaml", OccupancyGrid(twice, 0.05))
    told = aligned(capsys, tmp_path / "a.yaml", tmp_path / "a.yaml")
    assert told.startswith("ambiguous: b may lie at x ") and told.count("; or at x ") == 1
    found = re.findall(r"x (\S+) m, y (\S+) m, (\S+) deg", told)
    places = np.array(found, dtype=float)
    x_m, y_m = (0.05 * cells for cells in twice.shape[::-1])
    np.testing.assert_allclose(np.abs(places), [[0.0, 0.0, 0.0], [x_m, y_m, 180.0]], atol=0.2)
