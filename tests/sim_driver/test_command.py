"""The command as a user calls it: in a process of its own."""

from __future__ import annotations

import gzip
import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from mrslam.spatial import OccupancyGrid, write_map
from mrslam.spatial.files.images import write_image


def mrslam(*arguments: object, cwd: Path | None = None) -> subprocess.CompletedProcess[str]:
    code = "from mrslam.sim_driver.cli import main; main()"
    command = [sys.executable, "-c", code, *(str(argument) for argument in arguments)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, timeout=300, check=False)


def room(path: Path) -> Path:
    """Write the map of an L-shaped room."""
    cells = np.full((160, 200), -1, dtype=np.int8)
    cells[10:150, 10:190] = 100
    cells[13:147, 13:187] = 0
    cells[80:147, 120:187] = 100
    cells[84:150, 124:190] = -1
    write_map(path, OccupancyGrid(cells, 0.05, (-2.0, 1.0)))
    return path


def one_line_error(result: subprocess.CompletedProcess[str], code: int = 1) -> str:
    assert result.returncode == code, result.stderr
    assert "Traceback" not in result.stderr
    lines = [line for line in result.stderr.splitlines() if line.startswith("mrslam: ")]
    assert len(lines) == 1, result.stderr
    return lines[0]


def test_help_names_every_command_and_needs_no_heavy_import() -> None:
    result = mrslam("--help")
    assert result.returncode == 0
    for command in ("demo", "map", "run", "align", "merge", "feed", "config"):
        assert command in result.stdout


def test_a_wrong_call_is_exit_code_2() -> None:
    assert mrslam("map").returncode == 2
    assert mrslam("frobnicate").returncode == 2


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (None, "x.clf: no such file"),
        (b"", "no FLASER or ROBOTLASER1 line"),
        (b"FLASER 3 1.0 2.0", "cut off in its last line"),
        (b"\x1f\x8b\x08\x00garbage", "gzip stream is cut off or broken"),
        (b"\x00\xff binary\n" * 50, "no FLASER or ROBOTLASER1 line"),
    ],
)
def test_a_broken_log_is_one_clear_line(tmp_path: Path, content: bytes | None, message: str) -> None:
    log = tmp_path / "x.clf"
    if content is not None:
        log.write_bytes(content)
    assert message in one_line_error(mrslam("map", log, "--out", tmp_path / "out"))


def test_a_broken_mission_is_one_clear_line(tmp_path: Path) -> None:
    mission = tmp_path / "m.toml"
    mission.write_text('[mission]\nsped = 3\n[[robots]]\nid = "r1"\nlog = "none.clf"\n')
    assert "unknown key 'sped'; did you mean 'speed'" in one_line_error(mrslam("run", mission, "--out", tmp_path / "o"))
    mission.write_text('[[robots]]\nid = "r1"\nlog = "none.clf"\n')
    assert "none.clf: not found" in one_line_error(mrslam("run", mission, "--out", tmp_path / "o"))
    assert "no such mission file" in one_line_error(mrslam("run", tmp_path / "nothing.toml"))
    assert "comms.exchange_timeout_s" in one_line_error(
        mrslam("run", mission, "--set", "comms.exchange_timeout_s=-1", "--out", tmp_path / "o")
    )


def test_a_missing_or_broken_map_is_one_clear_line(tmp_path: Path) -> None:
    good = room(tmp_path / "a.yaml")
    assert "no such map file" in one_line_error(mrslam("align", good, tmp_path / "b.yaml"))
    (tmp_path / "b.yaml").write_text("image: b.pgm\nresolution: 0.05\norigin: [0, 0, 0]\n")
    assert "'b.pgm' does not exist" in one_line_error(mrslam("align", good, tmp_path / "b.yaml"))
    assert "no alignment method 'magic'" in one_line_error(mrslam("align", good, good, "--method", "magic"))
    assert "two maps or more" in one_line_error(mrslam("merge", good, "-o", tmp_path / "out"))


def test_output_that_cannot_be_written_is_one_clear_line(tmp_path: Path) -> None:
    good, file = room(tmp_path / "a.yaml"), tmp_path / "file"
    file.write_text("in the way")
    there = "cannot be made a folder"
    assert there in one_line_error(mrslam("merge", good, room(tmp_path / "b.yaml"), "-o", file / "out"))
    assert there in one_line_error(mrslam("run", "office-two", "--out", tmp_path / "out", "--rrd", file / "x.rrd"))
    assert there in one_line_error(mrslam("keys", "team", "r1", "--out", file))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("view", "nothing.rrd"), "no such folder of a run, and no such recording"),
        (("eval", "nothing"), "no such folder; name the one that a run left"),
        (("run", "office", "--set", "world.name=nowhere"), "no built-in world; those are arena1"),
        (
            ("run", "office", "--set", "mission.seed=-1"),
            "mission.seed must be a whole number in 0..9223372036854775807, got -1",
        ),
        (("agent", "r1", "--sensors", "nowhere"), "endpoint must look like tcp/"),
    ],
)
def test_a_mistake_is_told_with_what_to_do(tmp_path: Path, arguments: tuple[str, ...], message: str) -> None:
    assert message in one_line_error(mrslam(*arguments, cwd=tmp_path))


def test_align_prints_one_json_object(tmp_path: Path) -> None:
    a = room(tmp_path / "a.yaml")
    result = mrslam("align", a, a, "--json")
    assert result.returncode == 0, result.stderr
    answer = json.loads(result.stdout)
    assert {"status", "T_a_b", "places", "confidence", "reason", "evidence", "seconds"} <= answer.keys()
    assert answer["status"] in ("accepted", "ambiguous", "rejected")


def test_align_draws_how_two_maps_fit(tmp_path: Path) -> None:
    a = room(tmp_path / "a.yaml")
    result = mrslam("align", a, a, "--picture", tmp_path / "new" / "fit.png")
    assert result.returncode == 0, result.stderr
    assert (tmp_path / "new" / "fit.png").read_bytes().startswith(b"\x89PNG")
    assert "the picture is a .png file" in one_line_error(mrslam("align", a, a, "--picture", tmp_path / "fit.jpg"))


def test_merge_by_known_poses_places_maps_that_do_not_overlap(tmp_path: Path) -> None:
    room(tmp_path / "a.yaml")
    room(tmp_path / "b.yaml")
    (tmp_path / "poses.csv").write_text("map,x_m,y_m,theta_rad\na,0,0,0\nb,20,0,0.5\n")
    maps = [tmp_path / "a.yaml", tmp_path / "b.yaml"]
    result = mrslam("merge", *maps, "-o", tmp_path / "out", "--known-poses", tmp_path / "poses.csv", "--json")
    assert result.returncode == 0, result.stderr
    placed = json.loads(result.stdout)["placed"]
    np.testing.assert_allclose(placed["b"], [20.0, 0.0, 0.5], atol=0.02)
    assert (tmp_path / "out" / "team_map.png").stat().st_size > 0
    assert (tmp_path / "out" / "team_map.pgm").stat().st_size > 0


def test_config_tells_every_setting() -> None:
    result = mrslam("config")
    assert result.returncode == 0, result.stderr
    assert "exchange_timeout_s = 30.0" in result.stdout and "particles = 30" in result.stdout


def test_map_writes_what_it_promises_and_the_same_bytes_for_one_seed(tmp_path: Path, data_dir: Path) -> None:
    log = data_dir / "small" / "loop5.clf.gz"
    for name in ("one", "two"):
        result = mrslam("map", log, "--particles", 5, "--seed", 3, "--out", tmp_path / name)
        assert result.returncode == 0, result.stderr
    for file in ("trajectory.tum", "trajectory_online.tum", "map.pgm", "map.yaml", "map.png", "keyframes.npz"):
        assert (tmp_path / "one" / file).read_bytes() == (tmp_path / "two" / file).read_bytes()
    metrics = json.loads((tmp_path / "one" / "metrics.json").read_text())
    promised = "wall_s cpu_s scans scans_processed ms_per_processed_p50 ms_per_processed_p95 peak_rss_mb neff_min"
    assert {*promised.split(), "resamplings", "compile_s"} <= metrics.keys()
    assert len((tmp_path / "one" / "trajectory.tum").read_text().splitlines()) == metrics["scans"] == 551
    assert metrics["doubtful"]["scans"] == 0 and "doubtful" not in result.stderr


def test_a_log_of_one_scan_is_mapped(tmp_path: Path) -> None:
    ranges = " ".join(f"{2 + i / 100}" for i in range(181))
    (tmp_path / "one.clf").write_text(f"FLASER 181 {ranges} 0 0 0 0 0 0 1.0 host 1.0\n")
    result = mrslam("map", tmp_path / "one.clf", "--particles", 4, "--out", tmp_path / "out", "--json")
    assert result.returncode == 0, result.stderr
    metrics = json.loads(result.stdout)
    assert metrics["scans"] == 1 and metrics["neff_min"] == 1.0 and metrics["known_area_m2"] > 3.0


def test_of_a_log_that_is_cut_off_what_is_whole_is_used_where_that_is_asked_for(tmp_path: Path) -> None:
    ranges = " ".join(f"{2 + i / 100}" for i in range(181))
    line = f"FLASER 181 {ranges} 0 0 0 0 0 0 1.0 host 1.0\n"
    (tmp_path / "cut.clf").write_text(line + line.replace("1.0", "2.0") + line[:300])
    options = ("--particles", 4, "--out", tmp_path / "out", "--json")
    assert "--salvage uses the scans before" in one_line_error(mrslam("map", tmp_path / "cut.clf", *options))
    for command in (("map", tmp_path / "cut.clf", *options), ("feed", tmp_path / "cut.clf", "--json")):
        result = mrslam(*command, "--salvage")
        assert result.returncode == 0, result.stderr
        assert json.loads(result.stdout)["scans"] == 2


def test_a_saved_map_is_merged_of_maps_that_find_each_other_or_not_at_all(tmp_path: Path) -> None:
    a, b = room(tmp_path / "a.yaml"), room(tmp_path / "b.yaml")
    for option in (("--resolution", 0.1), ("--known-poses", tmp_path / "poses.csv"), ("--pictures",)):
        result = mrslam("merge", a, b, "-o", tmp_path / "both.mrslam", *option)
        assert result.returncode == 2 and "no known poses, resolution or" in " ".join(result.stderr.split())
    assert not (tmp_path / "both.mrslam").exists()


def test_a_log_whose_scans_are_of_no_use_is_no_silent_failure(tmp_path: Path) -> None:
    lines = (f"FLASER 4 2.0 2.{k} 3.{k} 2.5 0 0 0 0 0 0 {k}.0 host {k}.0" for k in range(9))
    (tmp_path / "four.clf").write_text("\n".join(lines) + "\n")
    result = mrslam("map", tmp_path / "four.clf", "--no-odometry", "--particles", 4, "--out", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    assert "9 of 9 scans were of no use, 9 of them: 4 usable returns, 10 are needed" in result.stderr + result.stdout


def test_map_tells_where_a_log_goes_on_elsewhere(tmp_path: Path, data_dir: Path) -> None:
    """The wheels begin anew, and the robot was carried to another building: nothing tells how both lie."""
    lines = []
    for name, count in (("intel", 600), ("mit-csail", 300)):
        with gzip.open(data_dir / "slam" / f"{name}.clf.gz", "rt", errors="replace") as file:
            lines.append([line.split() for line in file if line.startswith("FLASER")][:count])
    later_s = float(lines[0][-1][-3]) + 20.0 - float(lines[1][0][-3])
    for words in lines[1]:
        words[-3] = f"{float(words[-3]) + later_s:.6f}"
    log = tmp_path / "torn.clf"
    log.write_text("".join(" ".join(words) + "\n" for part in lines for words in part))
    result = mrslam("map", log, "--particles", 5, "--out", tmp_path / "out")
    assert result.returncode == 0, result.stderr
    began_s = float(lines[1][0][-3]) - float(lines[0][0][-3])
    stretches = json.loads((tmp_path / "out" / "metrics.json").read_text())["doubtful"]["stretches_s"]
    assert any(abs(begin - began_s) < 1.0 for begin, _ in stretches)
    assert "doubtful where the robot was for" in result.stderr


def test_map_interrupted_keeps_what_it_has_and_relations_are_judged(tmp_path: Path, data_dir: Path) -> None:
    code = (
        "import sys, rbpf\n"
        "update, left = rbpf.Mapper.update, [120]\n"
        "def interrupted(self, *scan):\n"
        "    left[0] -= 1\n"
        "    if left[0] < 0: raise KeyboardInterrupt\n"
        "    return update(self, *scan)\n"
        "rbpf.Mapper.update = interrupted\n"
        "from mrslam.sim_driver.cli import main; main()"
    )
    log = data_dir / "slam" / "aces.clf.gz"
    relations = data_dir / "slam" / "aces.relations"
    command = [sys.executable, "-c", code, "map", log, "--relations", relations, "--out", tmp_path]
    result = subprocess.run([*map(str, command)], capture_output=True, text=True, timeout=300, check=False)
    assert result.returncode == 130 and "interrupted after" in result.stderr, result.stderr
    metrics = json.loads((tmp_path / "metrics.json").read_text())
    assert metrics["interrupted_after_scans"] == metrics["scans"]
    assert metrics["relations"].keys() == {"trajectory", "trajectory_online"}
    given = len(relations.read_text().splitlines())
    assert metrics["relations"]["trajectory"]["relations_given"] == given
    used = metrics["relations"]["trajectory"]["relations"]
    assert (
        f"over {used} of {given} relations" in result.stderr if used else f"none of {given} relations" in result.stderr
    )
    assert len((tmp_path / "trajectory.tum").read_text().splitlines()) == metrics["scans"]


def test_a_world_from_a_bitmap_without_scale_says_how_large_it_is_taken_to_be(tmp_path: Path) -> None:
    image = np.full((60, 80), 255, dtype=np.uint8)
    image[[0, -1], :] = image[:, [0, -1]] = 0
    write_image(tmp_path / "plan.png", image)
    text = (
        '[mission]\nname = "m"\nshell = "virtual"\nduration_s = 1\n[world]\nname = "plan.png"\n[[robots]]\nid = "a"\n'
    )
    for scale, said in (("", True), ("scale_m = 0.1\n", False)):
        (tmp_path / "m.toml").write_text(text.replace('"plan.png"\n', f'"plan.png"\n{scale}'))
        result = mrslam("run", tmp_path / "m.toml", "--out", tmp_path / "out")
        assert result.returncode == 0, result.stderr
        assert ("plan.png: 0.05 m a pixel, 4.0 x 3.0 m; world.scale_m changes it" in result.stderr) == said


@pytest.mark.parametrize("words", [["r1", "--keys", "k"], ["--mode", "central", "r1", "--ros-args", "-r", "__ns:=/r1"]])
def test_what_is_no_option_of_the_node_is_refused_with_the_parameter_that_it_is(words: list[str]) -> None:
    result = mrslam("ros", *words)
    word = next(word for word in words if word.startswith("--"))
    assert result.returncode == 2, result.stderr
    assert f"{word} is no option" in result.stderr
    assert f"-p {word[2:]}:=" in result.stderr
