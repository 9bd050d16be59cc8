"""What agents left on their own is judged as a run is: a run is taken apart into agents and gathered again."""

from __future__ import annotations

import json
import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from mrslam.comms.wire.frames import check_name
from mrslam.sim_driver.cli.app import app
from mrslam.sim_driver.evaluate import References, assess
from mrslam.sim_driver.evaluate.results import RunResults
from mrslam.sim_driver.missions.agent_record import AgentRecord
from mrslam.sim_driver.missions.run_files import team_file
from mrslam.sim_driver.replay.again import replay_mission
from mrslam.sim_driver.report import write_report
from mrslam.sim_driver.report.data import page_data
from mrslam.sim_driver.run.gather import gather
from mrslam.sim_driver.run.run import run_mission
from mrslam.spatial import InputError
from mrslam.spatial.files.keyframes import read_keyframes
from mrslam.spatial.files.tum import read_tum, write_tum
from tests.sim_driver.runs import played

WORLD_S = 1_790_000_000.0
"""Agents tell times by the world's clock."""
TABLES = {
    "mission": {"shell": "virtual", "seed": 3, "duration_s": 25.0},
    "world": {"name": "arena1"},
    "robots": [{"id": "r1", "start": [2.0, 2.0, 0.0]}, {"id": "r2", "start": [3.0, 2.5, 1.0]}],
    "rbpf": {"particles": 4},
    "comms": {"exchange_timeout_s": 5.0, "beacon_window": 16},
}


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return played(TABLES, tmp_path_factory.mktemp("gather") / "run")


@pytest.fixture
def agents(run: Path, tmp_path: Path) -> Path:
    """The robots' folders as agents would have left them; of before that they began their maps, r1 has a past."""
    settings = json.loads((run / "config.json").read_text())["settings"]
    for robot_id in ("r1", "r2"):
        folder = tmp_path / "agents" / robot_id
        shutil.copytree(run / robot_id, folder)
        robot = json.loads((folder / "robot.json").read_text())
        for pair in robot["pairs"]:
            pair["accepted_at_s"] += WORLD_S
        (folder / "robot.json").write_text(json.dumps(robot))
        events = [json.loads(line) for line in (folder / "events.jsonl").read_text().splitlines()]
        lines = [json.dumps({**event, "t": event["t"] + WORLD_S}) for event in events]
        earlier = [json.dumps({"t": WORLD_S - 9e5, "robot": "r1", "event": "mapped"})] if robot_id == "r1" else []
        torn = [lines[0][:20]]
        (folder / "events.jsonl").write_text("\n".join([*earlier, *torn, *lines]) + "\n")
        record = AgentRecord(
            id=robot_id, team="depot", mode="distributed", log=None, settings=settings, begun_s=WORLD_S, ended=True
        )
        record.write(folder)
    return tmp_path / "agents"


def test_gathered_agents_have_the_merges_times_and_traffic_of_their_run(run: Path, agents: Path, tmp_path: Path):
    said: list[str] = []
    _, metrics = gather([agents], tmp_path / "out", said.append)
    before = json.loads((run / "metrics.json").read_text())
    first_s = min(e["t"] for told in RunResults.read(run).events.values() for e in told)
    (pair,), (known,) = metrics["pairs"], before["pairs"]
    assert pair["status"] == known["status"] == "accepted"
    assert pair["T_a_b"] == known["T_a_b"] and metrics["links"] == before["links"]
    assert pair["accepted_at_s"] == pytest.approx(known["accepted_at_s"] - first_s, abs=2e-3)
    assert pair["judged_by"] == "no truth" and metrics["name"] == "depot" and not said
    assert not (tmp_path / "out" / "r1" / "checkpoint").exists()


def test_gathered_agents_are_judged_by_references(run: Path, agents: Path, tmp_path: Path) -> None:
    gather([agents / "r1", agents / "r2"], tmp_path / "out", lambda text: None)
    truth = {robot: RunResults.read(run).laser_truth(robot) for robot in ("r1", "r2")}
    judged = assess(tmp_path / "out", References(trajectories={robot: way for robot, way in truth.items() if way}))
    (pair,), (known,) = judged["pairs"], assess(run)["pairs"]
    assert pair["verdict"] == known["verdict"] == "correct merge"
    assert pair["error_m"] < 0.1
    assert judged["robots"]["r1"]["trajectory"] == assess(run)["robots"]["r1"]["trajectory"]


def test_the_page_shows_an_agent_from_when_it_began(agents: Path, tmp_path: Path) -> None:
    late = agents / "r2"
    lines = [json.loads(line) for line in (late / "events.jsonl").read_text().splitlines()[1:]]
    (late / "events.jsonl").write_text("".join(json.dumps({**line, "t": line["t"] + 40.0}) + "\n" for line in lines))
    _, metrics = gather([agents], tmp_path / "out", lambda text: None)
    assert metrics["began_s"]["r1"] < 1.0 and 39.0 < metrics["began_s"]["r2"] < 42.0
    write_report(tmp_path / "out")
    places = page_data(RunResults.read(tmp_path / "out"))["map"]
    assert places is not None and (tmp_path / "out" / "report.html").stat().st_size > 10_000
    stamps, _ = read_tum(tmp_path / "out" / "r2" / "trajectory.tum")
    assert stamps[0] < 2e9  # as the driver gave them


def test_an_agent_that_runs_on_has_events_only(agents: Path, tmp_path: Path) -> None:
    (agents / "r2" / "robot.json").unlink()
    said: list[str] = []
    _, metrics = gather([agents], tmp_path / "out", said.append)
    assert metrics["robots_lost"] == ["r2"] and "r2 has not ended" in said[0]
    assert any(event["event"] == "mapped" for event in RunResults.read(tmp_path / "out").events["r2"])


def test_what_differs_or_is_not_here_is_said(agents: Path, tmp_path: Path) -> None:
    record = AgentRecord.read(agents / "r2")
    agent = {**record.settings["agent"], "tick_s": 0.2}
    other = {**record.settings, "agent": agent, "comms": {**record.settings["comms"], "link_threshold": 0.31}}
    replace(record, settings=other, log="/nowhere/at/all.clf", ended=False).write(agents / "r2")
    said: list[str] = []
    gather([agents], tmp_path / "out", said.append)
    assert "r2 ran with other settings than r1 (comms.link_threshold, agent.tick_s); r1's are shown" in said[0]
    assert "its log is not here" in said[1] and "its maps are of the time before" in said[2]


def test_settings_of_each_agent_are_shown(agents: Path, tmp_path: Path) -> None:
    record = AgentRecord.read(agents / "r2")
    other = {**record.settings, "rbpf": {**record.settings["rbpf"], "particles": 8}}
    replace(record, settings=other).write(agents / "r2")
    said: list[str] = []
    mission, _ = gather([agents], tmp_path / "out", said.append)
    assert {robot: own.rbpf.particles for robot, own in mission.settings_of.items()} == {"r1": 4, "r2": 8}
    rows = page_data(RunResults.read(tmp_path / "out"))["settings"]
    assert [row for row in rows if row[0].startswith("r2: ")] == [["r2: rbpf.particles", 8, True]] and not said


def test_what_cannot_be_gathered_is_told(agents: Path, tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    record = AgentRecord.read(agents / "r2")
    shutil.copytree(agents / "r2", tmp_path / "twin" / "r2")
    shutil.copytree(agents / "r2", tmp_path / "other" / "r3")
    replace(record, id="r3", team="yard").write(tmp_path / "other" / "r3")
    shutil.copytree(agents / "r2", tmp_path / "broken" / "r2")
    (tmp_path / "broken" / "r2" / "agent.json").write_text('{"id": 3}')
    for folders, words in (
        ([tmp_path / "nowhere"], "no such folder"),
        ([tmp_path / "empty"], "neither an agent's folder"),
        ([agents, tmp_path / "twin"], "are both of r2"),
        ([agents, tmp_path / "other"], "several teams"),
        ([tmp_path / "broken"], "not what an agent writes"),
    ):
        with pytest.raises(InputError, match=words):
            gather(folders, tmp_path / "out", lambda text: None)
    for out in (agents, agents / "r1"):
        with pytest.raises(InputError, match="name another one"):
            gather([agents], out, lambda text: None)
    assert (agents / "r1" / "robot.json").exists()


@pytest.mark.parametrize("settings", [{"rbpf": 5}, {"robots": [{"id": "r9"}]}])
def test_settings_of_an_agent_that_are_no_sections_are_refused_in_one_line(
    agents: Path, tmp_path: Path, settings: object
) -> None:
    path = agents / "r1" / "agent.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), "settings": settings}))
    with pytest.raises(InputError, match=r"^[^\n]*agent\.json: not what an agent writes[^\n]*$"):
        gather([agents], tmp_path / "out", lambda text: None)


def test_the_team_of_gathered_agents_is_theirs_whatever_their_settings_say(agents: Path, tmp_path: Path) -> None:
    record = AgentRecord.read(agents / "r1")
    others = {"mission": {"name": "yard", "shell": "virtual"}, "robots": {"id": "r9"}}
    replace(record, settings={**record.settings, **others}).write(agents / "r1")
    mission, _ = gather([agents], tmp_path / "out", lambda text: None)
    assert (mission.mission.name, mission.mission.shell) == ("depot", "agents")
    assert [robot.id for robot in mission.robots] == ["r1", "r2"]


def test_what_agents_did_cannot_be_run_again(agents: Path, tmp_path: Path) -> None:
    mission, _ = gather([agents], tmp_path / "out", lambda text: None)
    with pytest.raises(InputError, match="cannot be run again"):
        run_mission(mission, tmp_path / "again", lambda now_s, total_s, text: None, lambda text: None)
    with pytest.raises(InputError, match="cannot be played again"):
        replay_mission(tmp_path / "out")


def test_what_each_agent_was_and_played_is_the_missions(agents: Path, tmp_path: Path) -> None:
    log = tmp_path / "one.clf"
    log.write_text("FLASER 4 2.0 2.1 3.0 2.5 0 0 0 0 0 0 1.0 host 1.0\n")
    replace(AgentRecord.read(agents / "r2"), mode="mapper", log=str(log)).write(agents / "r2")
    said: list[str] = []
    mission, _ = gather([agents], tmp_path / "out", said.append)
    assert [(robot.id, robot.mode, robot.log) for robot in mission.robots] == [
        ("r1", "distributed", None), ("r2", "mapper", str(log))
    ]  # fmt: skip
    assert not said


def test_gathered_robots_have_every_scan_of_teammates_as_they_bent_their_ways(agents: Path, tmp_path: Path) -> None:
    own, _ = read_keyframes(agents / "r2" / "keyframes.npz")
    path = agents / "r1" / team_file("r2")
    path.parent.mkdir(exist_ok=True)
    write_tum(path, own.stamps_ns, own.T_map_base + np.array([0.5, 0.0, 0.0]))
    every_ns, every = read_tum(agents / "r2" / "trajectory.tum")
    assert 2 < len(own.stamps_ns) < every_ns.size
    gather([agents], tmp_path / "out", lambda text: None)
    found_ns, found = read_tum(tmp_path / "out" / "r1" / team_file("r2"))
    np.testing.assert_array_equal(found_ns, every_ns)
    np.testing.assert_allclose(found[:, 0] - every[:, 0], 0.5, atol=0.05)


def test_pairs_that_were_not_merged_stay_so(agents: Path, tmp_path: Path) -> None:
    path = agents / "r1" / "robot.json"
    robot = json.loads(path.read_text())
    robot["pairs"][0] |= {"status": "rejected", "accepted_at_s": None, "T_a_b": None}
    path.write_text(json.dumps(robot))
    gather([agents], tmp_path / "out", lambda text: None)
    (pair,) = json.loads((tmp_path / "out" / "r1" / "robot.json").read_text())["pairs"]
    assert (pair["status"], pair["accepted_at_s"]) == ("rejected", None)


def test_the_command_leaves_a_page_and_says_where_or_prints_the_metrics(agents: Path, tmp_path: Path) -> None:
    page = tmp_path / "out" / "report.html"
    arguments = ["gather", str(agents), "--out", str(page.parent)]
    result = CliRunner().invoke(app, arguments)
    assert result.exit_code == 0 and result.stdout == "" and page.stat().st_size > 10_000
    assert "r1 and r2" in result.stderr and f"look at {page}" in result.stderr.replace("\n", "")
    result = CliRunner().invoke(app, [*arguments, "--json"])
    assert json.loads(result.stdout)["name"] == "depot"


def test_of_agents_that_all_run_on_there_is_no_page(agents: Path, tmp_path: Path) -> None:
    for robot_id in ("r1", "r2"):
        (agents / robot_id / "robot.json").unlink()
    result = CliRunner().invoke(app, ["gather", str(agents), "--out", str(tmp_path / "out"), "--json"])
    assert result.exit_code == 0 and json.loads(result.stdout)["robots_lost"] == ["r1", "r2"]
    assert not (tmp_path / "out" / "report.html").exists()


def test_whatever_name_an_agent_may_have_it_is_gathered(tmp_path: Path) -> None:
    for name in ("r.1", "Robot-2_b."):
        record = AgentRecord(
            id=name, team="depot", mode="distributed", log=None, settings={}, begun_s=WORLD_S, ended=True
        )
        (tmp_path / "agents" / name).mkdir(parents=True)
        record.write(tmp_path / "agents" / name)
        check_name(name, "robot id")
    mission, metrics = gather([tmp_path / "agents"], tmp_path / "out", lambda words: None)
    assert [robot.id for robot in mission.robots] == metrics["robots_lost"] == ["Robot-2_b.", "r.1"]
