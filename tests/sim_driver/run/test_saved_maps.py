"""A recorded drive cut in two: the first part is saved as a map, and a robot of the second finds its place in it."""

from __future__ import annotations

import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from mrslam.agent import Agent, Settings
from mrslam.sim_driver.cli.live.ros import _make_agent
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.replay.again import mission_of
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.ros.parameters import parameters, resolve
from mrslam.sim_driver.run.team import make_agent, take_maps
from mrslam.spatial import InputError, read_tum, se2, write_map
from mrslam.spatial.se2 import Transform
from tests.merge.plans import building
from tests.sim_driver.runs import played

DEFAULTS = {one.name: one.default for one in parameters()}
FAST = {"particles": 8, "threads": 1}


def tables(log: Path, first: float, last: float, *, saved: Path | None = None, duration_s: float | None = None) -> Any:
    mission: dict[str, Any] = {"shell": "virtual", "seed": 1, "linger_s": 1.0}
    if duration_s is not None:
        mission["duration_s"] = duration_s
    maps = [] if saved is None else [{"path": str(saved), "id": "r1@monday"}]
    robot = {"id": "r1", "log": str(log), "first": first, "last": last}
    return {"mission": mission, "robots": [robot], "maps": maps, "rbpf": FAST}


def events(run: Path, kind: str) -> list[dict[str, Any]]:
    lines = map(json.loads, (run / "r1" / "events.jsonl").read_text().splitlines())
    return [line for line in lines if line["event"] == kind]


def saved_row(run: Path) -> Any:
    (row,) = json.loads((run / "r1" / "robot.json").read_text())["saved_maps"]
    return row


@pytest.fixture(scope="module")
def monday(data_dir: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the run of the first half of the intel log, which has driven through all of the building."""
    log = data_dir / "slam" / "intel.clf.gz"
    if not log.exists():
        pytest.skip(f"no {log}")
    return played(tables(log, 0.0, 0.5), tmp_path_factory.mktemp("saved") / "monday")


def nearest(way: tuple[Any, Transform], stamps_ns: Any) -> Transform:
    k = np.clip(np.searchsorted(way[0], stamps_ns), 0, len(way[0]) - 1)
    return way[1][k]


def test_a_later_part_of_a_drive_finds_its_place(monday: Path, data_dir: Path, tmp_path: Path) -> None:
    log = data_dir / "slam" / "intel.clf.gz"
    run = played(tables(log, 0.6, 0.7, saved=monday, duration_s=80.0), tmp_path / "tuesday")
    found = events(run, "localised")
    assert len(found) == 1 and not events(run, "not_localised")
    # Judged by the reference: from the saved drive's place nearest by to the robot's at its end.
    truth = read_tum(data_dir / "slam" / "intel.reference.tum")
    saved, own = read_tum(monday / "r1" / "trajectory.tum"), read_tum(run / "r1" / "trajectory.tum")
    true_saved, now = nearest(truth, saved[0]), nearest(truth, own[0][-1:])[0]
    k = int(np.argmin(np.hypot(*(true_saved[:, :2] - now[:2]).T)))
    expected = se2.compose(saved[1][k], se2.between(true_saved[k], now))
    row = saved_row(run)
    off = se2.between(expected, np.array(row["T_map_base"]))
    assert row["state"] == "localised" and np.hypot(*off[:2]) < 0.3 and abs(off[2]) < np.radians(5.0)
    write_report(run)  # a robot that nobody heard of is no trouble to it
    assert mission_of(run).maps[0].id == "r1@monday"


def test_another_building_is_not_the_saved_one(monday: Path, data_dir: Path, tmp_path: Path) -> None:
    log = data_dir / "slam" / "mit-csail.clf.gz"
    run = played(tables(log, 0.0, 0.5, saved=monday, duration_s=120.0), tmp_path / "elsewhere")
    assert not events(run, "localised") and len(events(run, "alignment")) > 2
    row = saved_row(run)
    assert row["state"] == "not here" and row["T_map_base"] is None and "no place in it that fits" in row["reason"]
    assert events(run, "not_here")


def test_a_saved_map_is_not_replaced_by_the_run_that_reads_it(monday: Path, data_dir: Path) -> None:
    log = data_dir / "slam" / "intel.clf.gz"
    with pytest.raises(InputError, match="the mission reads this file of an earlier run"):
        played(tables(log, 0.6, 0.7, saved=monday, duration_s=5.0), monday)
    assert (monday / "r1" / "keyframes.npz").exists()


@pytest.mark.parametrize(
    ("maps", "words"),
    [
        ([{"path": "x", "id": "monday"}], r"^maps.id must be two names .* joined by '@'"),
        ([{"id": "r1@monday"}], r"m.toml: maps\[0\]: the key 'path' is missing"),
        ([{"path": "x", "size": 3}], r"m.toml: maps\[0\].*size"),
        (["x"], r"maps are \[\[maps\]\] sections"),
        ([{"path": "x", "robots": ["r2"]}], r"m.toml: maps\[0\].robots: unknown key 'r2'; did you mean 'r1'"),
    ],
)
def test_what_is_no_saved_map_of_a_mission(maps: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        make_mission({"robots": [{"id": "r1", "log": "x.clf"}], "maps": maps}, Path("m.toml"))


def test_a_mission_gives_a_map_to_the_robots_that_it_names(tmp_path: Path) -> None:
    for name in ("monday", "tuesday"):
        write_map(tmp_path / f"{name}.yaml", building())
    maps = [
        {"path": str(tmp_path / "monday.yaml"), "id": "office@monday", "robots": ["r1"]},
        {"path": str(tmp_path / "tuesday.yaml"), "id": "office@tuesday"},
    ]
    robots = [{"id": "r1", "log": "x.clf"}, {"id": "r2", "log": "x.clf"}]
    mission = make_mission({"robots": robots, "maps": maps}, tmp_path / "m.toml")
    given = [[at.map_id for at in make_agent(mission, robot, 1).whereabouts()] for robot in mission.robots]
    assert given == [["office@monday", "office@tuesday"], ["office@tuesday"]]


@pytest.mark.parametrize("robot", ["agent", "node"])
def test_a_ros_node_takes_saved_maps_as_an_agent_does(robot: str, tmp_path: Path) -> None:
    for name in ("office", "depot"):
        (tmp_path / name).mkdir()
        write_map(tmp_path / name / "map.yaml", building())
    office, depot = tmp_path / "office", tmp_path / "depot"
    option = "--near" if robot == "agent" else "near"

    def made(maps: list[Path], near: str) -> Agent:
        if robot == "agent":
            agent = Agent("r1", Settings())
            said.append(take_maps(agent, maps, near or None))
            return agent
        options, settings = resolve({**DEFAULTS, "robot": "r1", "maps": " ".join(map(str, maps)), "near": near}, "/")
        return _make_agent(SimpleNamespace(options=options, settings=settings, say=said.append))  # type: ignore[arg-type]

    said: list[str] = []
    agent = made([office, depot], "")
    assert [at.map_id for at in agent.whereabouts()] == ["map@depot", "map@office"]
    assert said == ["r1 looks for its place in map@office, map@depot"]
    made([office], "2,1.5")
    assert said[1] == "r1 looks for its place in map@office, first near 2,1.5"
    assert not made([], "").whereabouts()
    with pytest.raises(InputError, match=f"^{option} is a place of one saved map"):
        made([office, depot], "2,1.5")
    with pytest.raises(InputError, match=f"^{option} wants X,Y or X,Y,THETA"):
        made([office], "here")
    with pytest.raises(InputError, match="nowhere: no such map file"):
        made([tmp_path / "nowhere"], "")
