from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

from mrslam.sim_driver.missions.mission import load_mission, make_mission
from mrslam.spatial import InputError

ROBOT = {"id": "r1", "log": "x.clf"}


def make(**tables: Any) -> Any:
    return make_mission({"robots": [ROBOT], **tables}, Path("m.toml"))


def test_a_mission_needs_only_robots() -> None:
    mission = make()
    assert mission.mission.name == "m"
    assert [robot.id for robot in mission.robots] == ["r1"]
    assert mission.settings.comms.link_threshold == 0.8


def test_a_robots_own_settings_lie_over_those_of_the_mission() -> None:
    robots = [ROBOT, {**ROBOT, "id": "r2", "mode": "mapper", "rbpf": {"particles": 60}, "agent": {"give_up_s": 9.0}}]
    mission = make(robots=robots, rbpf={"particles": 7, "resolution_m": 0.1})
    r1, r2 = (mission.settings_of[robot.id] for robot in mission.robots)
    assert r1 == mission.settings
    assert (r1.rbpf.particles, r2.rbpf.particles) == (7, 60)
    assert r1.rbpf.resolution_m == r2.rbpf.resolution_m == 0.1
    assert r2.agent.give_up_s == 9.0 and r2.comms == mission.settings.comms


@pytest.mark.parametrize(
    ("section", "key", "value"),
    [
        ("rbpf", "particles", 9),
        ("alignment", "min_confidence", 0.9),
        ("mutual_detection", "margin_m", 0.2),
        ("merge", "resolution_m", 0.2),
        ("agent", "give_up_s", 9.0),
    ],
)
def test_a_robot_may_have_its_own_settings_of_every_package(section: str, key: str, value: object) -> None:
    mission = make(robots=[ROBOT, {**ROBOT, "id": "r2", section: {key: value}}])
    r1, r2 = (getattr(mission.settings_of[robot.id], section) for robot in mission.robots)
    assert getattr(r2, key) == value != getattr(r1, key)


def test_a_trace_makes_the_links_traced() -> None:
    assert make(links={"trace": "t.csv"}).settings.comms.link_source == "trace"
    assert make().settings.comms.link_source == "measured"


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ({"robots": []}, r"at least one \[\[robots\]\]"),
        ({"robots": [ROBOT, ROBOT]}, "two robots have one id"),
        ({"robots": [{"id": "r 1", "log": "x"}]}, r"robots\.id must be 1 to 64 letters"),
        ({"robots": [{"id": ".r1", "log": "x"}]}, r"robots\.id must be 1 to 64 letters, .* not '\.' first"),
        ({"robots": [{"id": "r" * 65, "log": "x"}]}, r"robots\.id must be 1 to 64 letters"),
        ({"robots": [{"id": "metrics.json", "log": "x"}]}, r"robots\.id must be no file of the run"),
        ({"robots": [{"log": "x"}]}, r"robots\[0\]: the key 'id' is missing"),
        ({"robots": [{"id": "r1"}]}, "has no log"),
        ({"robots": [{"id": "r1", "log": "x", "first": 0.5, "last": 0.2}]}, "0 <= first < last <= 1"),
        ({"robots": [{"id": "r1", "log": "x", "start": [float("nan"), 0, 0]}]}, r"robots\.r1\.start must be"),
        ({"robots": [{"id": "r1", "log": "x", "first": 0.5, "last": 0.5}]}, "0 <= first < last <= 1"),
        ({"robots": [{"id": "", "log": "x"}]}, r"robots\.id must be 1 to 64 letters"),
        ({"robots": [ROBOT | {"start": [1.0, 2.0]}]}, r"robots\.r1\.start must be \[x_m, y_m, theta_rad\]"),
        ({"robots": [ROBOT | {"start_known": True}]}, r"robots\.r1\.start_known must be false where no start is given"),
        ({"robots": [ROBOT | {"waypoints": [[1.0, 2.0, 0.0]]}]}, r"robots\.r1\.waypoints must be \[x_m, y_m\] each"),
        ({"robots": [ROBOT | {"mode": "centre"}]}, r"robots\.r1\.mode must be distributed, mapper or central"),
        ({"maps": [{"path": "m", "id": "office"}]}, r"maps\.id must be two names"),
        ({"maps": [{"path": "m", "near": [1.0]}]}, r"maps\.near must be \[x_m, y_m, theta_rad\] or"),
        ({"mission": {"linger_s": -1}}, r"mission\.linger_s must be in 0\.\."),
        ({"world": {"name": "arena1", "walkers": -1}}, r"world\.walkers must be a whole number in 0\.\.1000, got -1"),
        ({"sweep": {"seeds": 0}}, r"sweep\.seeds must be a whole number in 1\.\."),
        ({"mision": {}}, "unknown key 'mision'; did you mean 'mission'"),
        ({"mission": {"speed": 0}}, r"mission\.speed must be in 0\.01\.\.1000, got 0"),
        ({"mission": {"shell": "thread"}}, "'process' or 'virtual'"),
        ({"comms": {"exchange_timeout": 3}}, "did you mean 'exchange_timeout_s'"),
        ({"faults": [{"kind": "kidnapped", "robot": "r1", "at_s": 3}]}, "r1 plays a log, so nobody can carry it off"),
        (
            {
                "world": {"name": "arena1"},
                "robots": [{"id": "r1"}, {"id": "base", "mode": "central"}],
                "faults": [{"kind": "kidnapped", "robot": "base", "at_s": 3}],
            },
            "base has no body, so nobody can carry it off",
        ),
        ({"faults": [{"kind": "liar", "robot": "r1", "at_s": 3}]}, "liar must be 0 s: it lies from start to end"),
        (
            {"mission": {"duration_s": 20}, "faults": [{"kind": "slow", "robot": "r1", "at_s": 20, "amount": 2}]},
            "ends after 20 s, so slow of r1 at 20 s never happens",
        ),
        ({"mission": {"duration_s": float("inf")}}, r"mission\.duration_s must be a finite number, got inf"),
        ({"radio": {"power_dbm": "nan"}}, r"radio\.power_dbm must be a finite number"),
        ({"comms": 3}, r"\[comms\] must be a section"),
        (
            {"robots": [ROBOT | {"rbpf": {"particle": 9}}]},
            r"robots\[0\] \(r1\): rbpf: unknown key 'particle'; did you mean",
        ),
        (
            {"robots": [ROBOT | {"rbpf": {"particles": 0}}]},
            r"robots\[0\] \(r1\): rbpf\.particles must be a whole number in 1\.\.1000, got 0",
        ),
        ({"robots": [ROBOT | {"rbpf": 3}]}, r"robots\[0\]\.rbpf = 3: Expected `object`"),
        ({"robots": [ROBOT | {"comms": {"link_threshold": 0.5}}]}, "unknown key 'comms'"),
        ({"robots": [ROBOT | {"agent": {"tick_s": 0.2}}]}, r"robots\.r1\.agent\.tick_s must be that of the mission"),
    ],
)
def test_every_mistake_is_named(tables: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make(**tables)


def test_the_missions_of_the_repository_are_valid() -> None:
    missions = sorted((Path(__file__).parents[3] / "missions").glob("*.toml"))
    assert missions
    for path in missions:
        load_mission(path)


def test_robots_that_were_not_recorded_together_are_no_evidence_and_simulated_ones_are_all_visible() -> None:
    recorded, simulated = make(), make(world={"name": "office"}, robots=[{"id": "r1"}, {"id": "r2"}])
    assert not recorded.settings.mutual_detection.encounters
    assert simulated.settings.mutual_detection.encounters and simulated.settings.mutual_detection.teammates_visible
    assert make(mutual_detection={"encounters": True}).settings_of["r1"].mutual_detection.encounters


def test_starts_that_the_team_knows_are_told_to_all() -> None:
    robots = [{"id": "a", "start": [1.0, 2.0, 0.5], "start_known": True}, {"id": "b"}]
    mission = make_mission({"robots": robots, "world": {"name": "office"}}, Path("m.toml"))
    assert [mission.settings_of[name].agent.starts for name in "ab"] == [{"a": [1.0, 2.0, 0.5]}] * 2


def test_a_saved_map_for_nobody_in_the_team_is_named() -> None:
    tables = {"robots": [{"id": "a"}], "world": {"name": "office"}, "maps": [{"path": "m.mrslam", "robots": ["c"]}]}
    with pytest.raises(InputError, match=r"maps\[0\]\.robots: unknown key 'c'"):
        make_mission(tables, Path("m.toml"))


def test_the_truth_is_one_of_a_missions_files() -> None:
    tables = {"robots": [{"id": "a", "log": "a.log"}], "truth": {"relations": "a.relations"}}
    assert make_mission(tables, Path("m.toml")).files == ["a.log", "a.relations"]


def test_what_set_gets_wrong_is_said_of_it_and_not_of_the_mission(tmp_path: Path) -> None:
    path = tmp_path / "m.toml"
    path.write_text('[[robots]]\nid = "r1"\nlog = "some.log"\n')
    for assignment, words in (
        ("foo.bar=1", "unknown key 'foo'"),
        ("comms.exchange_timeot_s=3", "comms: unknown key 'exchange_timeot_s'; did you mean 'exchange_timeout_s'"),
        ("mission.speed=fast", "mission.speed = 'fast'"),
    ):
        with pytest.raises(InputError, match=f"^--set: {re.escape(words)}"):
            load_mission(path, [assignment])
    with pytest.raises(InputError, match=r"^--set robots\.id=r2: 'robots' is a list"):
        load_mission(path, ["robots.id=r2"])
