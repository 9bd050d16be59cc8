"""What the page lists: tries to align, events and settings."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.run_files import TEAM_IMAGE_FILE, TEAM_OVERLAY_FILE
from mrslam.sim_driver.report import data as module
from mrslam.sim_driver.report.one_map import one_map_data

ROBOT = {"id": "r1", "log": "x.clf"}


def event(robot: str, t: float, kind: str, **more: Any) -> dict[str, Any]:
    return {"robot": robot, "t": t, "event": kind, **more}


def heard(*events: dict[str, Any]) -> Any:
    robots = sorted({one["robot"] for one in events})
    return SimpleNamespace(events={robot: [one for one in events if one["robot"] == robot] for robot in robots})


def tried(robot: str, t: float, status: str) -> dict[str, Any]:
    said = {"a": "r1", "b": "r2", "status": status, "reason": "", "confidence": 0.876, "evidence": {"overlap": 0.4}}
    return event(robot, t, "alignment", **said)


def test_tries_say_whether_they_were_accepted() -> None:
    found = module._attempts(
        heard(tried("r1", 3.0, "rejected"), tried("r2", 5.0, "accepted"), event("r1", 4.0, "sees"))
    )
    assert [(one["t"], one["robot"], one["pair"], one["accepted"]) for one in found] == [
        (3.0, "r1", "r1-r2", False),
        (5.0, "r2", "r1-r2", True),
    ]
    assert found[0]["confidence"] == 0.88 and found[0]["overlap"] == 0.4


def test_events_of_all_robots_are_told_in_the_order_of_time() -> None:
    events = [event("r1", t, "doubtful") for t in (1.0, 7.0)] + [event("r2", t, "recovered") for t in (0.5, 5.0)]
    assert [line[0] for line in module._ticker(heard(*events))] == [0.5, 1.0, 5.0, 7.0]


def test_of_too_many_events_those_that_matter_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "TICKER_LINES", 4)
    plain, bad = ([event("r1", float(k), kind) for k in range(3)] for kind in ("recovered", "doubtful"))
    assert len(module._ticker(heard(*plain, bad[0]))) == 4
    assert [line[1] for line in module._ticker(heard(*plain, *bad))] == ["bad"] * 3
    assert len(module._ticker(heard(*plain, *plain))) == 4


def test_settings_that_differ_come_first_and_those_of_one_robot_are_among_them() -> None:
    robots = [ROBOT, {**ROBOT, "id": "r2", "rbpf": {"particles": 60}}]
    mission = make_mission({"robots": robots, "rbpf": {"particles": 7}, "mission": {"seed": 3}}, Path("m.toml"))
    rows = module._settings(SimpleNamespace(mission=mission))  # type: ignore[arg-type]
    assert ["rbpf.particles", 7, True] in rows and ["r2: rbpf.particles", 60, True] in rows
    assert ["mission.seed", 3, False] in rows and ["rbpf.resolution_m", 0.05, False] in rows
    marks = [differs for _, _, differs in rows]
    assert marks == sorted(marks, reverse=True) and sum(marks) < 10


def test_one_map_is_of_the_first_robot_that_has_both_pictures_with_its_matches() -> None:
    ties = [["r1", "r2", 1, 2, True], ["r1", "r2", 1, 3, True], ["r1", "r2", 4, 5, False], ["r2", "r3", 1, 1, False]]
    has = {"r1": (TEAM_IMAGE_FILE,), "r2": (TEAM_IMAGE_FILE, TEAM_OVERLAY_FILE), "r3": ()}

    def picture(robot: str, file: str) -> bytes | None:
        return b"picture" if file in has[robot] else None

    robots: dict[str, Any] = {robot: {"ties": ties} for robot in has}
    found = one_map_data(SimpleNamespace(robots=robots, picture=picture))  # type: ignore[arg-type]
    assert found is not None and found["robot"] == "r2"
    assert found["ties"] == [["r1-r2", 2, 1], ["r2-r3", 0, 1]]
