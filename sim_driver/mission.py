"""Missions: which robots, what each of them senses, how they hear each other, and with which settings.

A mission is a TOML file; ``docs/missions.md`` lists its keys. Everything in it can be left out but the robots.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from agent import Settings
from sim_driver.drivers import DriverConfig
from sim_driver.faults import FaultConfig
from sim_driver.locate import locate
from sim_driver.radio import RadioConfig
from sim_driver.settings import build, check_keys, read_toml, with_overrides
from sim_driver.shipped import find_mission
from sim_driver.view.options import ViewOptions
from spatial import InputError
from spatial.errors import require


@dataclass(frozen=True, kw_only=True)
class MissionConfig:
    """The mission as a whole."""

    name: str = ""
    """What reports call it; the file's name unless given."""
    seed: int = 0
    """Everything random follows from it."""
    duration_s: float | None = None
    """Mission time after which all stop, seconds; without it, when all robots have finished."""
    linger_s: float = 60.0
    """Mission time that robots stay after the last has finished, so that they can still meet, seconds, >= 0."""
    speed: float = 1.0
    """Mission seconds in a second of wall time, for real processes, > 0."""
    shell: str = "process"
    """"process": one operating-system process a robot, over Zenoh; "virtual": all in one, in virtual time."""
    record: bool = True
    """Whether what simulated robots sense is kept (about 15 kB a second and robot), for replays and the report."""
    restart: bool = False
    """Whether a robot whose process dies is started again, from its checkpoint; real processes only."""

    def __post_init__(self) -> None:
        require(self.duration_s is None or self.duration_s > 0, "mission.duration_s", "> 0 s", self.duration_s)
        require(self.linger_s >= 0, "mission.linger_s", ">= 0 s", self.linger_s)
        require(self.speed > 0, "mission.speed", "> 0", self.speed)
        require(self.shell in ("process", "virtual"), "mission.shell", "'process' or 'virtual'", self.shell)


@dataclass(frozen=True, kw_only=True)
class RobotConfig:
    """One robot: recorded (it has a ``log``) or simulated (the mission has a ``world``)."""

    id: str
    """Its name, unique in the team: letters, digits, - and _."""
    mode: str = "distributed"
    """"distributed", "mapper" (maps and sends, does not merge) or "central" (merges, does not map)."""
    log: str | None = None
    """Recorded log: a path, or a name in the data folder."""
    first: float = 0.0
    """Where in the log this robot begins, as a share of its scans, 0..1."""
    last: float = 1.0
    """Where it ends."""
    laser: str = "lidar-360"
    """Laser of a simulated robot, by name."""
    start: list[float] | None = None
    """Start of a simulated robot in the world [x_m, y_m, theta_rad], unknown to the robot; random unless given."""
    driver: str = "explore"
    """What drives a simulated robot."""
    waypoints: list[list[float]] = field(default_factory=list)
    """World points [x_m, y_m] for the driver "waypoints"."""
    patrol: bool = False
    """Whether the driver "waypoints" begins again at the first when it has reached the last."""
    trajectory: str | None = None
    """TUM file of poses in the world for the driver "trajectory"; the robot starts at the first unless told."""

    def __post_init__(self) -> None:
        ok = bool(self.id) and all(c.isalnum() or c in "-_" for c in self.id) and self.id.isascii()
        require(ok, "robots.id", "a name of letters, digits, - and _", self.id)
        require(
            self.mode in ("distributed", "mapper", "central"),
            f"robots.{self.id}.mode",
            "distributed, mapper or central",
            self.mode,
        )
        require(
            0.0 <= self.first < self.last <= 1.0,
            f"robots.{self.id}.first, last",
            "0 <= first < last <= 1",
            [self.first, self.last],
        )
        require(
            self.start is None or len(self.start) == 3, f"robots.{self.id}.start", "[x_m, y_m, theta_rad]", self.start
        )


@dataclass(frozen=True, kw_only=True)
class LinksConfig:
    """How robots hear each other."""

    keys: str | None = None
    """Folder of the team's keys (``mrslam keys``): links are mutual TLS; process shell only."""
    trace: str | None = None
    """CSV file ``t_s,a,b,quality``: link qualities over time; a quality holds until the pair's next line."""


@dataclass(frozen=True, kw_only=True)
class TruthConfig:
    """What the outcome is judged by; robots never see it."""

    relations: str | None = None
    """Relations file of the recorded log."""


@dataclass(frozen=True, kw_only=True)
class WorldConfig:
    """Where simulated robots are."""

    name: str
    """Built-in world ("office", "arena1", "office:SEED", ...), map YAML or bitmap."""
    scale_m: float | None = None
    """Metres a pixel of a bitmap."""


@dataclass(frozen=True, kw_only=True)
class SweepConfig:
    """What ``mrslam sweep`` varies where its command line names nothing; a single run does not look at it."""

    vary: list[str] = field(default_factory=list)
    """Settings and their values, each "section.key=value,value,..."."""
    seeds: int = 5
    """Runs of every setting, each with its own seed, >= 1."""

    def __post_init__(self) -> None:
        require(self.seeds >= 1, "sweep.seeds", ">= 1", self.seeds)


@dataclass(frozen=True, kw_only=True)
class Mission:
    """A mission, checked and with its files found."""

    mission: MissionConfig
    robots: tuple[RobotConfig, ...]
    settings: Settings
    links: LinksConfig
    truth: TruthConfig
    world: WorldConfig | None
    radio: RadioConfig
    driver: DriverConfig
    faults: tuple[FaultConfig, ...] = ()
    """What goes wrong, in virtual time."""
    folder: Path
    """Where the mission's file lies: names in it are looked for there first."""
    replay: Path | None = None
    """Folder of the run whose drive and radio are played again; its simulated robots do not drive anew."""
    view: ViewOptions = field(default_factory=ViewOptions)
    """Who looks on; changes nothing of what happens."""

    def find(self, name: str) -> Path:
        """Return a file the mission names."""
        return locate(name, self.folder)


def load_mission(path: Path, assignments: Sequence[str] = ()) -> Mission:
    """Read a mission file, or a shipped mission, with ``section.key=value`` options laid over it.

    Every mistake is an ``InputError``.
    """
    path = find_mission(path)
    return make_mission(with_overrides(read_toml(path), assignments), path)


def make_mission(tables: dict[str, Any], path: Path) -> Mission:
    """Return the mission that these tables describe; ``path`` is named in errors."""
    sections = {section.name: section.type for section in fields(Settings)}
    named = ["mission", "robots", "world", "driver", "radio", "links", "truth", "faults", "sweep", *sections]
    check_keys(tables, named, str(path))
    build(SweepConfig, tables.get("sweep", {}), f"{path}: sweep")
    for name, table in tables.items():
        if name not in ("robots", "faults") and not isinstance(table, dict):
            raise InputError(f"{path}: [{name}] must be a section, got {table!r}")
    raw_robots = tables.get("robots", [])
    if not isinstance(raw_robots, list) or not raw_robots or not all(isinstance(robot, dict) for robot in raw_robots):
        raise InputError(f"{path}: a mission needs at least one [[robots]] section")
    robots = tuple(build(RobotConfig, robot, f"{path}: robots[{i}]") for i, robot in enumerate(raw_robots))
    ids = [robot.id for robot in robots]
    if len(set(ids)) != len(ids):
        raise InputError(f"{path}: two robots have one id among {', '.join(ids)}")
    world = build(WorldConfig, tables["world"], f"{path}: world") if "world" in tables else None
    for robot in robots:
        if robot.log is None and world is None and robot.mode != "central":
            raise InputError(f"{path}: robot {robot.id} has no log, and the mission has no [world] to simulate it in")
    raw_faults = tables.get("faults", [])
    if not isinstance(raw_faults, list) or not all(isinstance(fault, dict) for fault in raw_faults):
        raise InputError(f"{path}: faults are [[faults]] sections")
    faults = tuple(build(FaultConfig, fault, f"{path}: faults[{i}]") for i, fault in enumerate(raw_faults))
    for fault in faults:
        require(fault.robot in ids, f"{path}: faults.robot", f"one of {', '.join(ids)}", fault.robot)
    mission = {"name": path.stem, **tables.get("mission", {})}
    links = build(LinksConfig, tables.get("links", {}), f"{path}: links")
    if links.trace is not None:
        tables = {**tables, "comms": {"link_source": "trace", **tables.get("comms", {})}}
    return Mission(
        mission=build(MissionConfig, mission, f"{path}: mission"),
        robots=robots,
        settings=make_settings(tables, str(path)),
        links=links,
        truth=build(TruthConfig, tables.get("truth", {}), f"{path}: truth"),
        world=world,
        driver=build(DriverConfig, tables.get("driver", {}), f"{path}: driver"),
        radio=build(RadioConfig, tables.get("radio", {}), f"{path}: radio"),
        faults=faults,
        folder=path.resolve().parent,
    )


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
