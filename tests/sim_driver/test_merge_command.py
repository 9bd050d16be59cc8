"""How `mrslam merge` names the maps it is given, and the poses that are known of them."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mrslam.merge import merge_maps
from mrslam.merge.joint.consistent import KeyMatch
from mrslam.merge.joint.ties import Tie
from mrslam.sim_driver.cli.maps.merge import (
    _say_bends,
    in_folders,
    merge_files,
    read_maps,
    read_poses,
    read_trails,
    short_names,
    target_of,
)
from mrslam.spatial import InputError, KeyScans, OccupancyGrid, write_map
from mrslam.spatial.files.images import write_image
from mrslam.spatial.files.keyframes import read_keyframes, write_keyframes
from mrslam.spatial.files.tum import read_tum
from tests.merge.joint.blocks import Drive, drive, errors_m, local_map
from tests.merge.plans import building


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["a.yaml", "maps/b.png"], ["a", "b"]),
        (["run1/map.yaml", "run2/map.yaml", "b.yaml"], ["run1/map", "run2/map", "b"]),
        (["r1/maps/map.yaml", "r2/maps/map.yaml"], ["r1/maps/map", "r2/maps/map"]),
        (["maps/map.yaml", "maps/map.png", "map.yaml"], ["maps/map.yaml", "maps/map.png", "here/map"]),
        (["/map.yaml", "/here/map.yaml"], ["map", "here/map"]),
    ],
)
def test_files_are_called_as_short_as_tells_them_apart(files: list[str], names: list[str]) -> None:
    assert short_names([Path("/there/here") / file for file in files]) == names


def test_what_is_written_is_a_yaml_file_or_a_folder(tmp_path: Path) -> None:
    assert target_of(tmp_path / "map.yml") == tmp_path / "map.yaml"  # as maps are written
    assert target_of(tmp_path / "merged") == tmp_path / "merged" / "team_map.yaml"
    with pytest.raises(InputError, match=r"x\.png: name a folder, or a \.yaml file \(.*/x\.yaml\)"):
        target_of(tmp_path / "x.png")
    (tmp_path / "v1.2").mkdir()
    assert target_of(tmp_path / "v1.2") == tmp_path / "v1.2" / "team_map.yaml"


def test_a_file_given_twice_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="given twice"):
        short_names([tmp_path / "a.yaml", tmp_path / "b" / ".." / "a.yaml"])


def test_known_poses_name_maps_as_they_are_called_or_by_their_files(tmp_path: Path) -> None:
    path = tmp_path / "poses.csv"
    path.write_text("map,x_m,y_m,theta_rad\nr1/maps/map.yaml,1,0,0\n/data/r2/maps/map.yaml,2,0,0\nb,3,0,0\n")
    names = ["r1/maps/map", "r2/maps/map", "b", "map"]
    assert {name: pose[0] for name, pose in read_poses(path, names).items()} == dict(
        zip(names, (1, 2, 3), strict=False)
    )
    for word in ("ab.yaml", "", "."):
        path.write_text(f"{word},1,0,0\n")
        with pytest.raises(InputError, match="line 1: needs one of the maps"):
            read_poses(path, names)
    for word in ("nan", "inf"):
        path.write_text(f"b,{word},0,0\n")
        with pytest.raises(InputError, match="and a finite pose"):
            read_poses(path, names)
    path.write_text(f"b,{'1' * 200_000},0,0\n")
    with pytest.raises(InputError, match=r"poses\.csv: not a CSV file"):
        read_poses(path, names)


def test_no_map_that_is_read_is_replaced(tmp_path: Path) -> None:
    maps = [tmp_path / "a.yaml", tmp_path / "b.yaml"]
    for path in maps:
        write_map(path, OccupancyGrid(np.zeros((60, 60), dtype=np.int8), 0.05))
    before = maps[0].with_suffix(".pgm").read_bytes()
    for given in (maps, [maps[0].with_suffix(".pgm"), maps[1]]):
        with pytest.raises(InputError, match="would be replaced by the merged map"):
            merge_files(given, maps[0], None, "auto", None, [], as_json=False)
    assert maps[0].with_suffix(".pgm").read_bytes() == before


def test_maps_whose_poses_are_known_are_laid_there(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    cells = building().cells
    for name, part in (("a", cells[:, :120]), ("b", cells[:, 200:])):
        write_map(tmp_path / f"{name}.yaml", OccupancyGrid(part, 0.05))
    (tmp_path / "poses.csv").write_text("a.yaml,0,0,0\nb.yaml,30,-1,0.5\n")
    given = [tmp_path / "a.yaml", tmp_path / "b.yaml"]
    merge_files(given, tmp_path / "out", tmp_path / "poses.csv", "auto", None, [], False)
    told = capsys.readouterr().err.replace("\n", " ")
    assert "b placed at x 30.000 m, y -1.000 m, turned by 28.65 deg" in told
    row = json.loads((tmp_path / "out" / "team_map.json").read_text())
    np.testing.assert_allclose(row["placed"]["b"], [30.0, -1.0, 0.5], atol=1e-9)
    with pytest.raises(InputError, match="merging needs two maps or more"):
        merge_files(given[:1], tmp_path / "other", None, "auto", None, [], False)
    assert not (tmp_path / "other").exists()


def test_both_maps_of_a_pair_are_merged_and_drawn(tmp_path: Path) -> None:
    cells = building().cells
    np.savez(tmp_path / "p.npz", a=cells, origin_a=(0.0, 0.0), b=cells[:, 40:], origin_b=(0.0, 0.0), res=0.05)
    grids = read_maps([tmp_path / "p.npz"], None)
    assert {name: grid.shape for name, grid in grids.items()} == {"p:a": cells.shape, "p:b": cells[:, 40:].shape}
    merge_files([tmp_path / "p.npz"], tmp_path / "out", None, "auto", None, [], False, pictures=True)
    assert [path.name for path in (tmp_path / "out" / "pairs").iterdir()] == ["p_a--p_b.png"]
    write_image(tmp_path / "bare.png", np.full((6, 7), 254, dtype=np.uint8))
    assert read_maps([tmp_path / "bare.png"], 0.2)["bare"].resolution_m == 0.2


def test_maps_that_look_alike_at_two_places_say_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    half = building(rooms=3).cells
    for name in ("a", "b"):  # the same turned by half a turn
        write_map(tmp_path / f"{name}.yaml", OccupancyGrid(np.maximum(half, half[::-1, ::-1]), 0.05))
    merge_files([tmp_path / "a.yaml", tmp_path / "b.yaml"], tmp_path / "out", None, "auto", None, [], False)
    told = capsys.readouterr().err.replace("\n", " ")
    assert "how a and b fit is ambiguous: 2 places look alike" in told and "nothing was merged" in told


def test_the_maps_of_a_run_are_those_of_its_robots(tmp_path: Path) -> None:
    for folder in ("r2", "r1", "r1/old", "r10"):
        (tmp_path / folder).mkdir()
        (tmp_path / folder / "map.yaml").write_text("")
    assert in_folders([tmp_path]) == [tmp_path / name / "map.yaml" for name in ("r1", "r10", "r2")]
    assert in_folders([tmp_path / "r1"]) == [tmp_path / "r1" / "map.yaml"]


def test_a_way_without_scans_is_none(tmp_path: Path) -> None:
    folder = robot_folder(tmp_path / "r1", drive(0.0, 10.0))
    assert list(read_trails([folder / "map.yaml"])) == ["map"]
    keyframes, _ = read_keyframes(folder / "keyframes.npz")
    write_keyframes(folder / "keyframes.npz", keyframes, KeyScans.empty())
    assert read_trails([folder / "map.yaml"]) == {}


def robot_folder(folder: Path, drive_: Drive) -> Path:
    folder.mkdir(parents=True)
    local = local_map(drive_)
    write_map(folder / "map.yaml", local.map.to_grid())
    write_keyframes(folder / "keyframes.npz", local.keyframes, local.key_scans)
    return folder


def test_maps_of_robots_are_bent_and_their_ways_written(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    a, b = drive(0.0, 70.0, 0.0007, seed=1), drive(30.0, 80.0, -0.0007, seed=2)
    robot_folder(tmp_path / "run" / "r1", a)
    robot_folder(tmp_path / "run" / "r2", b)
    merge_files([tmp_path / "run"], tmp_path / "out", None, "auto", None, [], False)
    told = capsys.readouterr().err.replace("\n", " ")
    assert "places in common that agree" in told and told.count("is bent by up to") == 2
    ways = [read_tum(tmp_path / "out" / "team" / f"{name}_map.tum")[1] for name in ("r1", "r2")]
    assert errors_m(a, b, *ways).mean() < 0.1
    row = json.loads((tmp_path / "out" / "team_map.json").read_text())
    assert sorted(row["bent_m"]) == ["r1/map", "r2/map"] and len(row["ties"]) >= 12


def test_places_that_do_not_agree_are_not_counted_as_agreeing(capsys: pytest.CaptureFixture[str]) -> None:
    match = KeyMatch(0, 0, np.zeros(3), np.eye(3))
    ties = tuple(Tie(a, b, match, kept) for a, b, kept in (("a", "b", True), ("a", "b", False), ("b", "c", False)))
    _say_bends(replace(merge_maps({"a": building()}), ties=ties), {})
    told = capsys.readouterr().err.replace("\n", " ")
    assert "a and b saw 1 places in common that agree" in told and "b and c" not in told


def test_a_folder_without_maps_is_named(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match=r"empty: holds no map\.yaml"):
        in_folders([tmp_path / "empty"])


def test_keyframes_are_found_however_a_folder_is_called(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for k, name in enumerate(("r1", "r2")):
        robot_folder(tmp_path / name, drive(10.0 * k, 10.0 + 10.0 * k))
        (tmp_path / f"latest{k}").symlink_to(tmp_path / name)
    for words, here in ((["r1", "r2"], "."), ([".", "../r2"], "r1"), (["latest0", "latest1"], ".")):
        monkeypatch.chdir(tmp_path / here)
        paths = in_folders([Path(word) for word in words])
        assert list(read_trails(paths)) == list(read_maps(paths, None)) == ["r1/map", "r2/map"]


def test_maps_that_are_laid_as_they_are_are_named_in_the_order_of_placing(capsys: pytest.CaptureFixture[str]) -> None:
    merged = merge_maps({"a": building()})
    names = [f"r{k}" for k in range(9)]
    placed = replace(merged.team_map, T_team_map=dict.fromkeys(names, np.zeros(3)))
    _say_bends(replace(merged, team_map=placed), {})
    assert [line.split()[0] for line in capsys.readouterr().err.splitlines() if " laid as it is" in line] == names


def test_damaged_keyframes_are_named(tmp_path: Path) -> None:
    folder = robot_folder(tmp_path / "r1", drive(0.0, 10.0))
    (folder / "keyframes.npz").write_bytes(b"cut")
    with pytest.raises(InputError, match=r"keyframes\.npz: not a readable"):
        read_trails([folder / "map.yaml"])
