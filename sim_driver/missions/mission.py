"""Missions: which robots, what each of them senses, how they hear each other, and with which settings.

A mission is a TOML file; ``docs/missions.md`` lists its keys. Everything in it can be left out but the robots.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from mrslam.agent import Settings
from mrslam.sim_driver.drivers import DriverConfig
from mrslam.sim_driver.faults import FaultConfig
from mrslam.sim_driver.missions.locate import locate
from mrslam.sim_driver.missions.sections import (
    LinksConfig,
    MissionConfig,
    RobotConfig,
    SavedMapConfig,
    SweepConfig,
    TruthConfig,
    WorldConfig,
)
from mrslam.sim_driver.missions.settings import build, check_keys, made_with, read_toml
from mrslam.sim_driver.missions.shipped import find_mission
from mrslam.sim_driver.missions.view_options import ViewOptions
from mrslam.sim_driver.worlds.radio import RadioConfig
from mrslam.spatial import InputError
from mrslam.spatial.errors import require

LISTS = ("robots", "maps", "faults")
"""Sections of which a mission may have several."""
SECTIONS = ("mission", "world", "driver", "radio", "links", "truth", "sweep", *LISTS)
"""Sections of a mission file, beside those of the packages' settings."""


@dataclass(frozen=True, kw_only=True)
class Mission:
    """A mission, checked and with its files found."""

    mission: MissionConfig
    robots: tuple[RobotConfig, ...]
    settings: Settings
    """What holds for every robot that has no settings of its own."""
    settings_of: Mapping[str, Settings]
    """By robot: those settings with its own laid over them."""
    links: LinksConfig
    truth: TruthConfig
    world: WorldConfig | None
    radio: RadioConfig
    driver: DriverConfig
    faults: tuple[FaultConfig, ...] = ()
    """What goes wrong, in virtual time."""
    maps: tuple[SavedMapConfig, ...] = ()
    """Maps saved before, which every robot that merges takes."""
    folder: Path
    """Where the mission's file lies: names in it are looked for there first."""
    replay: Path | None = None
    """Folder of the run whose drive and radio are played again; its simulated robots do not drive again."""
    view: ViewOptions = field(default_factory=ViewOptions)
    """Who looks on; changes nothing of what happens."""

    @property
    def files(self) -> list[str]:
        """Names of the files that the mission reads, beside its world."""
        named = [name for robot in self.robots for name in (robot.log, robot.trajectory)]
        named += [one.path for one in self.maps]
        return [name for name in (*named, self.links.trace, self.truth.relations) if name is not None]

    def find(self, name: str) -> Path:
        """Return a file the mission names."""
        return locate(name, self.folder)


def load_mission(path: Path, assignments: Sequence[str] = ()) -> Mission:
    """Read a mission file, or a shipped mission, with ``section.key=value`` options laid over it.

    Every mistake is an ``InputError``.
    """
    path = find_mission(path)
    return made_with(lambda tables: make_mission(tables, path), read_toml(path), assignments, str(path))


def make_mission(tables: dict[str, Any], path: Path) -> Mission:
    """Return the mission that these tables describe; ``path`` is named in errors."""
    where = str(path)
    _check_sections(tables, where)
    robots = _robots(tables, where)
    world = build(WorldConfig, tables["world"], f"{where}: world") if "world" in tables else None
    mission = build(MissionConfig, {"name": path.stem, **tables.get("mission", {})}, f"{where}: mission")
    _check_bodies(robots, mission, world, where)
    faults = _faults(tables, robots, mission, where)
    links = build(LinksConfig, tables.get("links", {}), f"{where}: links")
    if links.trace is not None:
        tables = {**tables, "comms": {"link_source": "trace", **tables.get("comms", {})}}
    if starts := {robot.id: robot.start for robot in robots if robot.start_known}:
        tables = {**tables, "agent": {"starts": starts, **tables.get("agent", {})}}
    sight = {"encounters": False} if any(robot.log for robot in robots) else {"teammates_visible": True}
    tables = {**tables, "mutual_detection": {**sight, **tables.get("mutual_detection", {})}}
    return Mission(
        mission=mission,
        robots=robots,
        settings=make_settings(tables, where),
        settings_of=_settings_of(tables, robots, where),
        links=links,
        truth=build(TruthConfig, tables.get("truth", {}), f"{where}: truth"),
        world=world,
        driver=build(DriverConfig, tables.get("driver", {}), f"{where}: driver"),
        radio=build(RadioConfig, tables.get("radio", {}), f"{where}: radio"),
        faults=faults,
        maps=_maps(tables, robots, where),
        folder=path.resolve().parent,
    )


def _check_sections(tables: dict[str, Any], where: str) -> None:
    """Refuse sections that no mission has, and what stands where a section should."""
    check_keys(tables, [*SECTIONS, *(section.name for section in fields(Settings))], where)
    for name, table in tables.items():
        if name not in LISTS and not isinstance(table, dict):
            raise InputError(f"{where}: [{name}] must be a section, got {table!r}")
    build(SweepConfig, tables.get("sweep", {}), f"{where}: sweep")


def _robots(tables: dict[str, Any], where: str) -> tuple[RobotConfig, ...]:
    tables_of = tables.get("robots", [])
    if not isinstance(tables_of, list) or not tables_of or not all(isinstance(robot, dict) for robot in tables_of):
        raise InputError(f"{where}: a mission needs at least one [[robots]] section")
    robots = tuple(build(RobotConfig, robot, f"{where}: robots[{i}]") for i, robot in enumerate(tables_of))
    ids = [robot.id for robot in robots]
    if len(set(ids)) != len(ids):
        raise InputError(f"{where}: two robots have one id among {', '.join(ids)}")
    return robots


def _maps(tables: dict[str, Any], robots: Sequence[RobotConfig], where: str) -> tuple[SavedMapConfig, ...]:
    tables_of = tables.get("maps", [])
    if not isinstance(tables_of, list) or not all(isinstance(one, dict) for one in tables_of):
        raise InputError(f"{where}: maps are [[maps]] sections")
    maps = tuple(build(SavedMapConfig, one, f"{where}: maps[{i}]") for i, one in enumerate(tables_of))
    ids = [robot.id for robot in robots]
    for i, one in enumerate(maps):
        check_keys(one.robots or (), ids, f"{where}: maps[{i}].robots")
    return maps


def _check_bodies(robots: Sequence[RobotConfig], mission: MissionConfig, world: WorldConfig | None, where: str) -> None:
    """Refuse a robot that would have nothing to sense."""
    for robot in robots:
        if robot.log is None and world is None and robot.mode != "central" and mission.shell != "agents":
            raise InputError(f"{where}: robot {robot.id} has no log, and the mission has no [world] to simulate it in")


def _faults(
    tables: dict[str, Any], robots: Sequence[RobotConfig], mission: MissionConfig, where: str
) -> tuple[FaultConfig, ...]:
    tables_of = tables.get("faults", [])
    if not isinstance(tables_of, list) or not all(isinstance(fault, dict) for fault in tables_of):
        raise InputError(f"{where}: faults are [[faults]] sections")
    faults = tuple(build(FaultConfig, fault, f"{where}: faults[{i}]") for i, fault in enumerate(tables_of))
    logs = {robot.id: robot.log for robot in robots}
    central = {robot.id for robot in robots if robot.mode == "central"}
    for fault in faults:
        require(fault.robot in logs, f"{where}: faults.robot", f"one of {', '.join(logs)}", fault.robot)
        if fault.kind == "kidnapped" and logs[fault.robot] is not None:
            raise InputError(f"{where}: faults: {fault.robot} plays a log, so nobody can carry it off")
        if fault.kind == "kidnapped" and fault.robot in central:
            raise InputError(f"{where}: faults: {fault.robot} has no body, so nobody can carry it off")
        if mission.duration_s is not None and fault.at_s >= mission.duration_s:
            never = f"{fault.kind} of {fault.robot} at {fault.at_s:g} s never happens"
            raise InputError(f"{where}: faults: the mission ends after {mission.duration_s:g} s, so {never}")
    return faults


def make_settings(tables: dict[str, Any], where: str) -> Settings:
    """Return the settings of one robot from the sections named as the packages are."""
    default = Settings()
    parts = {
        section.name: build(
            type(getattr(default, section.name)), tables.get(section.name, {}), f"{where}: {section.name}"
        )
        for section in fields(Settings)
    }
    return Settings(**parts)


def _settings_of(tables: dict[str, Any], robots: Sequence[RobotConfig], where: str) -> dict[str, Settings]:
    """Return every robot's settings: the mission's, with its own laid over them."""
    settings_of = {}
    for i, robot in enumerate(robots):
        own = {section: {**tables.get(section, {}), **table} for section, table in robot.own_settings.items()}
        its = f"{where}: robots[{i}]"
        try:
            settings_of[robot.id] = make_settings({**tables, **own}, its)
        except InputError as error:
            said = str(error).removeprefix(f"{its}: ")
            raise InputError(f"{its} ({robot.id}): {said}") from error
    return settings_of
