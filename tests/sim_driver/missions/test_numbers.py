"""Every number that a user can set: refused in one line that names it and its bound, or a value that works."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from types import UnionType
from typing import Any, get_args, get_origin, get_type_hints

import pytest

from mrslam.agent import Settings
from mrslam.sim_driver.drivers import DriverConfig
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.missions.mission import make_mission
from mrslam.sim_driver.missions.sections import MissionConfig, RobotConfig, SweepConfig, WorldConfig
from mrslam.sim_driver.missions.settings import build
from mrslam.sim_driver.robots import LASERS, ChassisConfig, LaserModel, OdometryConfig
from mrslam.sim_driver.run.run import run_mission
from mrslam.sim_driver.worlds.radio import RadioConfig
from mrslam.spatial import InputError

SECTIONS: dict[str, tuple[type, dict[str, Any]]] = {
    **{field.name: (type(getattr(Settings(), field.name)), {}) for field in dataclasses.fields(Settings)},
    "mission": (MissionConfig, {}),
    "driver": (DriverConfig, {}),
    "radio": (RadioConfig, {}),
    "world": (WorldConfig, {"name": "arena1"}),
    "sweep": (SweepConfig, {}),
    "robots": (RobotConfig, {"id": "r1"}),
    "faults": (FaultConfig, {"kind": "clock", "robot": "r1"}),
}
"""Section of a mission file -> its type, and what it needs beside."""
LIBRARY = {
    "laser": (LaserModel, dataclasses.asdict(LASERS["lidar-360"])),
    "odometry": (OdometryConfig, {}),
    "robot": (ChassisConfig, {}),
}
"""What only a library user sets."""
NEVER = (1e300, -1e300, math.nan, math.inf, -math.inf)
SMALL = (1e-300, 0, -1)
TABLES: dict[str, Any] = {
    "mission": {"shell": "virtual", "duration_s": 2.0, "seed": 1, "record": False},
    "world": {"name": "arena1"},
    "robots": [{"id": "r1", "start": [2.0, 2.0, 0.0]}, {"id": "r2", "start": [3.0, 2.5, 1.0]}],
    "rbpf": {"particles": 2, "threads": 1},
}


def numbers_of(cls: type) -> list[str]:
    """The fields that are numbers, or lists of numbers."""
    return [name for name, hint in get_type_hints(cls).items() if _is_number(hint)]


def _is_number(hint: Any) -> bool:
    if get_origin(hint) in (UnionType, list, tuple):
        return any(_is_number(inner) for inner in get_args(hint))
    return hint in (int, float)


def value_for(cls: type, name: str, number: float) -> Any:
    """The number as this field takes it."""
    hint = str(get_type_hints(cls)[name])
    if "list[list" in hint:
        return [[number, 0.0]]
    if "list" in hint or "tuple" in hint:
        return [number, 0.0, 0.0]
    return number


ALL = [(section, name) for section, (cls, _) in {**SECTIONS, **LIBRARY}.items() for name in numbers_of(cls)]


def test_the_walk_meets_every_section() -> None:
    assert len(ALL) > 120 and {"duration_s", "tick_s", "start", "waypoints", "scale_m"} <= {name for _, name in ALL}


@pytest.mark.parametrize(("section", "name"), ALL)
def test_absurd_numbers_are_refused_by_name(section: str, name: str) -> None:
    cls, needs = {**SECTIONS, **LIBRARY}[section]
    for number in NEVER:
        values = {**needs, name: value_for(cls, name, number)}
        ways = [lambda values=values: cls(**values)]
        if section in SECTIONS:
            ways.append(lambda values=values: build(cls, values, section))
        for way in ways:
            with pytest.raises(InputError, match=name) as refused:
                way()
            assert "\n" not in str(refused.value)


@pytest.mark.parametrize(("section", "name"), ALL)
def test_small_numbers_are_taken_or_refused_by_name(section: str, name: str) -> None:
    cls, needs = {**SECTIONS, **LIBRARY}[section]
    for number in SMALL:
        try:
            cls(**{**needs, name: value_for(cls, name, number)})
        except InputError as refused:
            assert name in str(refused) and "\n" not in str(refused)


@pytest.mark.parametrize("section", [section for section in SECTIONS if section not in ("robots", "world", "faults")])
@pytest.mark.parametrize("number", SMALL)
def test_small_numbers_that_are_taken_work(section: str, number: float, tmp_path: Path) -> None:
    cls, needs = SECTIONS[section]
    taken = {}
    for name in numbers_of(cls):
        try:
            build(cls, {**needs, **taken, name: number}, section)
        except InputError:
            continue
        taken[name] = number
    tables = {**TABLES, section: {**TABLES.get(section, needs), **taken}}
    metrics = run_mission(make_mission(tables, Path("m.toml")), tmp_path, lambda *told: None, lambda text: None)
    assert metrics["mission_s"] == pytest.approx(2.0, abs=0.11)


@pytest.mark.parametrize(
    ("section", "name", "value", "bound"),
    [
        ("mission", "duration_s", 1e300, r"mission\.duration_s must be in 0\.1\.\.1e\+07 s, got 1e\+300"),
        ("agent", "tick_s", 1e-300, r"agent\.tick_s must be in 0\.001\.\.10 s, got 1e-300"),
        ("merge", "resolution_m", 1e-300, r"merge\.resolution_m must be in 0\.001\.\.10 m, got 1e-300"),
        ("world", "scale_m", 1e-300, r"world\.scale_m must be in 0\.001\.\.100 m, got 1e-300"),
        ("mission", "seed", -1, r"mission\.seed must be a whole number in 0\.\..*, got -1"),
    ],
)
def test_a_mission_says_the_bound(section: str, name: str, value: float, bound: str) -> None:
    tables = {**TABLES, section: {**TABLES.get(section, {}), name: value}}
    with pytest.raises(InputError, match=bound):
        make_mission(tables, Path("m.toml"))
