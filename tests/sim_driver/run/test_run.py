"""Whole missions, small ones: two robots in a small world."""

from __future__ import annotations

import json
from multiprocessing import Pipe
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mrslam.sim_driver.evaluate import assess
from mrslam.sim_driver.missions.mission import Mission, make_mission
from mrslam.sim_driver.run.children import _await_ready
from mrslam.sim_driver.run.run import run_mission
from mrslam.spatial import InputError
from mrslam.spatial.files.tum import read_tum, write_tum

TABLES = {
    "mission": {"seed": 2, "duration_s": 40.0, "speed": 3.0},
    "world": {"name": "arena2"},
    "robots": [{"id": "r1", "laser": "lidar-360"}, {"id": "r2", "laser": "lidar-360"}],
    "rbpf": {"particles": 6},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


def mission(shell: str, **changes: object) -> Mission:
    tables = {**TABLES, "mission": {**TABLES["mission"], "shell": shell, **changes}}
    return make_mission(tables, Path("small.toml"))


def run(one: Mission, out: Path) -> dict[str, object]:
    return run_mission(one, out, lambda mission_s, total_s, text: None, lambda text: None)


def files(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in sorted(folder.rglob("*")) if path.is_file()}


def check(metrics: dict[str, object], out: Path) -> None:
    for robot in ("r1", "r2"):
        names = {path.name for path in (out / robot).iterdir()}
        assert names >= {"map.pgm", "map.yaml", "team_map.pgm", "team_map.yaml", "team_map.png", "trajectory.tum"}
        events = [json.loads(line) for line in (out / robot / "events.jsonl").read_text().splitlines()]
        assert {"peer_seen", "link_changed", "exchange_done", "alignment"} <= {event["event"] for event in events}
    assert metrics["team"]["false_merges"] == 0  # type: ignore[index]
    (link,) = metrics["links"]  # type: ignore[misc]
    assert link["exchanges"] >= 1 and 0 < link["bytes_sent"] < link["bytes_full_raw"]


def test_virtual_time_gives_the_same_bytes_for_one_seed(tmp_path: Path) -> None:
    metrics = run(mission("virtual"), tmp_path / "one")
    check(metrics, tmp_path / "one")
    (pair,) = metrics["pairs"]  # type: ignore[misc]
    assert pair["status"] == "accepted", pair
    assert pair["error_m"] < 0.2 and pair["error_deg"] < 3.0
    one_thread = make_mission(
        {**TABLES, "mission": {**TABLES["mission"], "shell": "virtual"}, "rbpf": {"particles": 6, "threads": 1}},
        Path("small.toml"),
    )
    run(one_thread, tmp_path / "two")
    one, two = files(tmp_path / "one"), files(tmp_path / "two")
    assert one.pop("config.json") != two.pop("config.json")  # the number of threads
    assert one == two


def test_another_seed_gives_another_mission(tmp_path: Path) -> None:
    run(mission("virtual", duration_s=3.0), tmp_path / "one")
    run(mission("virtual", duration_s=3.0, seed=3), tmp_path / "two")
    assert files(tmp_path / "one")["r1/truth.tum"] != files(tmp_path / "two")["r1/truth.tum"]


@pytest.mark.slow
def test_real_processes_meet_and_merge(tmp_path: Path) -> None:
    metrics = run(mission("process", duration_s=60.0), tmp_path / "out")
    check(metrics, tmp_path / "out")
    assert metrics["exit_codes"] == {"r1": 0, "r2": 0}


def test_a_robot_follows_a_recorded_trajectory(tmp_path: Path) -> None:
    stamps = np.arange(0, 12) * 1_000_000_000
    poses = np.stack([np.linspace(1.0, 3.4, 12), np.full(12, 3.3), np.zeros(12)], axis=-1)
    write_tum(tmp_path / "drive.tum", stamps, poses)
    robots = [{"id": "r1", "driver": "trajectory", "trajectory": "drive.tum"}]
    tables = {
        "mission": {"shell": "virtual", "duration_s": 14.0},
        "world": {"name": "arena1"},
        "robots": robots,
        "rbpf": {"particles": 4},
    }
    run(make_mission(tables, tmp_path / "drive.toml"), tmp_path / "out")
    driven = read_tum(tmp_path / "out" / "r1" / "truth.tum")[1]
    assert np.allclose(driven[0], poses[0])
    assert np.hypot(*(driven[-1] - poses[-1])[:2]) < 0.4
    robots[0]["trajectory"] = "no.tum"
    with pytest.raises(InputError, match=r"no\.tum: not found"):
        run(make_mission(tables, tmp_path / "drive.toml"), tmp_path / "out2")


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        ({"driver": "trajectory"}, '"trajectory" needs trajectory = "a TUM file"'),
        ({"driver": "waypoints"}, '"waypoints" needs waypoints .* and a start'),
        ({"driver": "fly"}, "no driver 'fly'; there are explore"),
        ({"start": [1000.0, 2.0, 0.0]}, "start 1000, 2 is no floor of the world arena2, which has x from 0 to"),
    ],
)
def test_a_robot_that_cannot_start_is_told(tmp_path: Path, robot: dict[str, object], message: str) -> None:
    tables = {**TABLES, "mission": {"shell": "virtual"}, "robots": [{"id": "r1", **robot}]}
    with pytest.raises(InputError, match=message):
        run(make_mission(tables, Path("m.toml")), tmp_path / "out")


def test_faults_are_refused_where_they_would_not_come(tmp_path: Path) -> None:
    tables = {**TABLES, "faults": [{"kind": "crash", "robot": "r1", "at_s": 5.0}]}
    with pytest.raises(InputError, match="virtual time only"):
        run_mission(make_mission(tables, Path("small.toml")), tmp_path, lambda now_s, total_s, text: None, print)


def test_an_empty_trajectory_is_told(tmp_path: Path) -> None:
    write_tum(tmp_path / "none.tum", np.empty(0, dtype=np.int64), np.empty((0, 3)))
    robot = {"id": "r1", "driver": "trajectory", "trajectory": str(tmp_path / "none.tum")}
    tables = {**TABLES, "mission": {"shell": "virtual", "duration_s": 2.0}, "robots": [robot]}
    with pytest.raises(InputError, match="a TUM file with poses"):
        run(make_mission(tables, Path("small.toml")), tmp_path / "run")


def test_a_process_that_dies_as_it_comes_up_is_told() -> None:
    class Gone:
        """What is left of such a process."""

        robot_id, alive = "r1", False
        pipe, there = Pipe()
        process = SimpleNamespace(exitcode=-9, join=lambda timeout: None)

    Gone.there.close()
    with pytest.raises(InputError, match="the process of r1 ended with code -9 before it was ready"):
        _await_ready([Gone])  # type: ignore[list-item]


def test_a_merge_with_a_map_that_was_given_up_is_not_judged_by_the_new_one(tmp_path: Path) -> None:
    tables = {
        **TABLES,
        "mission": {"shell": "virtual", "seed": 3, "duration_s": 50.0},
        "world": {"name": "arena1"},
        "robots": [{"id": "r1", "start": [2.0, 2.0, 0.0]}, {"id": "r2", "start": [3.0, 2.5, 1.0]}],
        "faults": [{"kind": "amnesia", "robot": "r2", "at_s": 30.0, "for_s": 3.0}],
    }
    run(make_mission(tables, Path("small.toml")), tmp_path / "run")
    judged = assess(tmp_path / "run")["mission"]
    assert judged["first_merge_s"] < 30.0 and judged["wrong_merges_on_the_way"] == 0
